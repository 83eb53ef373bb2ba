#pragma once

#include <cstdint>
#include <string>

#include <opencv2/core.hpp>

#include "features/image_size.h"
#include "visual_localization/ros/image_conversion.h"

namespace visual_localization {

/// Throws ImageError when an image of this size, pixels, is empty or too large to be taken.
inline cv::Size requireImageSize(std::uint64_t width, std::uint64_t height) {
  if (width == 0 || height == 0) {
    throw ImageError("image is empty (" + std::to_string(width) + "x" + std::to_string(height) + ")");
  }
  if (const auto reason = whyTooLarge(width, height)) throw ImageError("image is too large: " + *reason);
  return {static_cast<int>(width), static_cast<int>(height)};
}

/// The largest value of the fewest of 10, 12, 14 and 16 bits that hold the brightest pixel.
inline double fullScaleOf(const cv::Mat& grey) {
  double brightest = 0.0;
  cv::minMaxIdx(grey, nullptr, &brightest);
  double full = 1023.0;
  while (full < brightest) full = 4.0 * full + 3.0;
  return full;
}

/// Cameras of 10, 12 or 14 bits send them in 16 and do not say which: the full scale of the image becomes the range. 8
/// bits stay. `cut`: the lower bits, as OpenCV does with a PNG, instead of rounded as cv_bridge does.
inline cv::Mat inEightBits(const cv::Mat& grey, bool cut = false) {
  if (grey.depth() == CV_8U) return grey;
  const double full = fullScaleOf(grey);
  cv::Mat eight;
  constexpr double kDown = -0.498;  // to the next whole number below, of any that has a fraction of 1/256
  cut ? grey.convertTo(eight, CV_8U, 256.0 / (full + 1.0), kDown) : grey.convertTo(eight, CV_8U, 255.0 / full);
  return eight;
}

}  // namespace visual_localization
