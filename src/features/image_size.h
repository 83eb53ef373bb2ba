#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <string>

#include <opencv2/core.hpp>

#include "visual_localization/features/local_features.h"

namespace visual_localization {

/// Largest width and height of an image.
constexpr int kMaxImageSide_px = 16384;
/// Largest product of both, for images of a map and for those that are decoded: 4096 x 4096. SIFT takes 140 bytes a
/// pixel, 2.3 GB for the largest image, and two to four seconds on one core unless all of it is fine structure.
constexpr std::int64_t kMaxImagePixels = std::int64_t{4096} * 4096;

/// Why an image of this size, pixels, is too large, in one line; nothing when it is not.
inline std::optional<std::string> whyTooLarge(std::uint64_t width, std::uint64_t height) {
  constexpr auto kSide = static_cast<std::uint64_t>(kMaxImageSide_px);
  constexpr auto kPixels = static_cast<std::uint64_t>(kMaxImagePixels);
  if (width <= kSide && height <= kSide && width * height <= kPixels) return std::nullopt;
  return std::to_string(width) + "x" + std::to_string(height) + " pixels, at most " + std::to_string(kMaxImagePixels) +
         " are allowed and " + std::to_string(kMaxImageSide_px) + " a side";
}

/// The same of a size that is not negative.
inline std::optional<std::string> whyTooLarge(const cv::Size& size) {
  return whyTooLarge(static_cast<std::uint64_t>(size.width), static_cast<std::uint64_t>(size.height));
}

/// Half of both sides, as often as it takes; 0: as recorded.
inline cv::Size halvedTo(double max_megapixels, cv::Size size) {
  const auto isTooLarge = [&] { return max_megapixels > 0.0 && size.area() > 1e6 * max_megapixels; };
  while (isTooLarge() && std::min(size.width, size.height) >= 2 * kSmallestImageSide_px) {
    size = (size + cv::Size(1, 1)) / 2;
  }
  return size;
}

}  // namespace visual_localization
