#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <opencv2/core.hpp>

#include "visual_localization/features/global_features.h"

namespace visual_localization {

/// The 4 x 4 subimages of an image and how much a pixel counts in its own: a 2-D Gaussian around the subimage's
/// centre (Weiss et al., section II). Separable: one table for the columns, one for the rows. A pixel on the border of
/// two subimages belongs to the one that holds its centre.
class SubimageGrid {
 public:
  SubimageGrid() = default;
  /// `relative_std`: of the Gaussian, in widths and heights of a subimage.
  SubimageGrid(cv::Size image_size, double relative_std);

  /// Adds the pixels [begin, end) of a row: pixel x counts `values[x]` times its weight, in bin `bins[x]`.
  void addRow(int row, int begin, int end, const float* values, const std::uint8_t* bins,
              GlobalFeatures::Histogram& histogram) const;

 private:
  /// Columns or rows.
  struct Axis {
    std::vector<std::size_t> subimage;  ///< 0 to 3
    std::vector<float> weight;
  };
  static Axis axis(int length_px, double relative_std);

  Axis columns_;
  Axis rows_;
};

/// Scales the histogram to sum one; one of zeros stays as it is.
void normalise(GlobalFeatures::Histogram& histogram);

}  // namespace visual_localization
