#pragma once

#include <opencv2/core.hpp>

namespace visual_localization {

/// Brightness of an image.
struct GreyLevels {
  double mean = 0.0;      ///< of 255
  double contrast = 0.0;  ///< standard deviation
};

/// `grey`: 8-bit, one channel. Takes nothing from the heap.
GreyLevels greyLevelsOf(const cv::Mat& grey);

/// A dark or foggy image with its grey levels spread to the usual contrast, in `buffer`; an image that has contrast
/// enough, or none but noise, as it is. Extractors look for a contrast in grey levels, and find nothing in a dull image
/// that shows all they need. The same for training images and live ones, so that both see the same.
const cv::Mat& withUsualContrast(const cv::Mat& grey, const GreyLevels& levels, cv::Mat& buffer);

}  // namespace visual_localization
