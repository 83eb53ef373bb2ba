#pragma once

#include <cstdint>
#include <vector>

#include <opencv2/core.hpp>

#include "visual_localization/features/global_features.h"
#include "visual_localization/features/subimage_grid.h"

namespace visual_localization {

/// Weighted gradient orientation histograms (Weiss et al., section II.A). Keeps its buffers from image to image.
///
/// The paper leaves open, and here it is: gradients are central differences, so the outermost pixels do not count;
/// the bins are centred on the multiples of 45 degrees, as in SIFT, from the image's x axis towards its y axis (down).
/// The histogram is left as it is summed: see GlobalExtractor for its scale, and for why.
class Wgoh {
 public:
  /// `grey` passes requireExtractable.
  GlobalFeatures::Histogram extract(const cv::Mat& grey);

 private:
  void prepare(cv::Size image_size);
  void findGradients(const std::uint8_t* above, const std::uint8_t* here, const std::uint8_t* below);

  cv::Size image_size_;
  SubimageGrid grid_;
  std::vector<float> magnitudes_;   ///< of one row, in grey levels over two pixels
  std::vector<std::uint8_t> bins_;  ///< of one row
};

}  // namespace visual_localization
