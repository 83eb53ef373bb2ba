#pragma once

#include <opencv2/imgproc.hpp>

namespace visual_localization {

/// `image` at this size: itself when it has it, otherwise resized into `buffer`.
inline const cv::Mat& fitted(const cv::Mat& image, cv::Size size, cv::Mat& buffer) {
  if (image.size() == size) return image;
  cv::resize(image, buffer, size, 0.0, 0.0, cv::INTER_AREA);
  return buffer;
}

/// How much wider than in the recording an image is shown at another size, in relation to its height; 1: not distorted.
inline double stretchOf(cv::Size recorded, cv::Size shown) {
  return static_cast<double>(shown.width) / recorded.width * recorded.height / shown.height;
}

}  // namespace visual_localization
