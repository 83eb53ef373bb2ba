#include "visual_localization/localizer/image_look.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace visual_localization {

ImageLook lookOf(const cv::Mat& grey) {
  std::uint64_t sum = 0;
  std::uint64_t squares = 0;
  for (int row = 0; row < grey.rows; ++row) {
    const auto* pixels = grey.ptr<std::uint8_t>(row);
    for (int column = 0; column < grey.cols; ++column) {
      const std::uint64_t value = pixels[column];
      sum += value;
      squares += value * value;
    }
  }
  const auto count = static_cast<double>(std::max<std::size_t>(1, grey.total()));
  const double mean = static_cast<double>(sum) / count;
  return {mean, std::sqrt(std::max(0.0, static_cast<double>(squares) / count - mean * mean)), 1.0};
}

bool areIdentical(const cv::Mat& a, const cv::Mat& b) {
  if (a.size() != b.size() || a.type() != b.type()) return false;
  for (int row = 0; row < a.rows; ++row) {
    const auto* pixels = a.ptr<std::uint8_t>(row);
    if (!std::equal(pixels, pixels + a.cols, b.ptr<std::uint8_t>(row))) return false;
  }
  return true;
}

}  // namespace visual_localization
