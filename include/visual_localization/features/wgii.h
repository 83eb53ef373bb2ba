#pragma once

#include <cstdint>
#include <vector>

#include <opencv2/core.hpp>

#include "visual_localization/features/global_features.h"
#include "visual_localization/features/subimage_grid.h"

namespace visual_localization {

/// Weighted grid integral invariants (Weiss et al., section II.B): of each pixel, the mean of the relational kernel
/// over ten rotations. Keeps its buffers from image to image.
///
/// The paper leaves open, and here it is: a pixel with a sample outside of the image does not count. Images with a side
/// below 160 pixels, where not even the centres of the outer subimages would count, are continued at their border
/// instead. The histogram is left as it is summed: see GlobalExtractor for its scale, and for why.
///
/// Computed in 16-bit integers, eight pixels at once. A pixel's invariant, in [0, 1], comes out too large by up to
/// 0.001; a bin is 0.125 wide. A constant added to all pixels changes nothing at all.
class Wgii {
 public:
  Wgii() = default;
  Wgii(Wgii&&) = default;  // a copy would share the pixels of its images
  Wgii& operator=(Wgii&&) = default;

  /// `grey` passes requireExtractable.
  GlobalFeatures::Histogram extract(const cv::Mat& grey);

 private:
  void prepare(cv::Size image_size);
  void findLevels(const cv::Mat& grey);
  void findBins(int row);

  cv::Size image_size_;
  SubimageGrid grid_;
  int margin_px_ = 0;               ///< the pixels so near to the border do not count
  cv::Mat continued_;               ///< the image and what it is continued by, if it is
  cv::Mat levels_;                  ///< the same as 16-bit fixed point numbers
  std::vector<std::int16_t> sums_;  ///< of the kernel over the rotations, for the counting pixels of one row
  std::vector<float> ones_;         ///< every pixel counts the same
  std::vector<std::uint8_t> bins_;  ///< of one row
};

}  // namespace visual_localization
