#pragma once

#include <opencv2/core.hpp>

namespace visual_localization {

/// What an image is like, whatever it shows.
struct ImageLook {
  double mean_grey = 0.0;  ///< of 255
  double contrast = 0.0;   ///< standard deviation, grey levels
  double stretch = 1.0;    ///< its width to height over the map's: another shape is stretched to the map's
};

/// Whether two 8-bit images of one channel are the same to the last bit.
bool areIdentical(const cv::Mat& a, const cv::Mat& b);

}  // namespace visual_localization
