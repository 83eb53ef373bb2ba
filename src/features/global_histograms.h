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
