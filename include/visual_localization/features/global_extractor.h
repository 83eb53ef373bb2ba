#pragma once

#include <cstdint>
#include <vector>

#include <opencv2/core.hpp>

#include "visual_localization/features/global_features.h"
#include "visual_localization/features/subimage_grid.h"

namespace visual_localization {

/// Image in, WGOH and WGII out. Keeps its tables and buffers from image to image. Not thread-safe: one extractor a
/// thread.
///
/// The paper leaves open, and here it is: gradients are central differences; the eight orientations begin at 0;
/// a pixel whose gradient or samples would leave the image does not count (images below 84 pixels, too small for
/// that, are continued at their border); every vector is scaled to sum one, since otherwise the image with the stronger
/// gradients would win. Best single image on the campus rounds, same day / across light: 1.8 / 6.9 m with that scaling,
/// 3.2 / 21.8 m without, 1.8 / 8.2 m with every image continued at its border.
class GlobalExtractor {
 public:
  /// Throws like requireExtractable.
  GlobalFeatures extract(const cv::Mat& grey);

 private:
  void prepare(cv::Size image_size);
  void addGradients(GlobalFeatures::Histogram& histogram);
  void addInvariants(GlobalFeatures::Histogram& histogram);

  cv::Size image_size_;
  SubimageGrid wgoh_grid_;
  SubimageGrid wgii_grid_;
  bool continued_ = false;          ///< the image is too small for WGII and is continued at its border
  cv::Mat image_;                   ///< intensities in [0, 1], 32-bit floats
  std::vector<float> sums_;         ///< of the kernel over the rotations, for one row
  std::vector<float> values_;       ///< what each pixel of a row counts
  std::vector<std::uint8_t> bins_;  ///< of each pixel of a row
};

}  // namespace visual_localization
