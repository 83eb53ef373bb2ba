#pragma once

#include <array>
#include <cstddef>
#include <memory>

#include <opencv2/core.hpp>

namespace visual_localization {

/// Histograms over a 4 x 4 grid of subimages, 8 bins each, concatenated row by row of the grid.
struct GlobalFeatures {
  static constexpr std::size_t kGridSide = 4;
  static constexpr std::size_t kBins = 8;
  static constexpr std::size_t kSize = kGridSide * kGridSide * kBins;  ///< 128
  using Histogram = std::array<float, kSize>;

  Histogram wgoh{};  ///< weighted gradient orientation histograms (Weiss et al., section II.A)
  Histogram wgii{};  ///< weighted grid integral invariants (Weiss et al., section II.B)
};

/// Normalised histogram intersection of Weiss et al., Eq. 1: sum of min(q, d) over the sum of q, in [0, 1]; 0 when the
/// query is empty.
double histogramIntersection(const GlobalFeatures::Histogram& query, const GlobalFeatures::Histogram& training);

/// Image in, WGOH and WGII out, each scaled to sum one. Keeps its tables and buffers from image to image. Not
/// thread-safe: one extractor a thread.
///
/// The paper leaves the scale open. Without it stronger gradients would always win; with one for each subimage plain
/// subimages would count like the others.
class GlobalExtractor {
 public:
  GlobalExtractor();
  ~GlobalExtractor();
  GlobalExtractor(GlobalExtractor&&) noexcept;
  GlobalExtractor& operator=(GlobalExtractor&&) noexcept;

  /// Throws like requireExtractable.
  GlobalFeatures extract(const cv::Mat& grey);

 private:
  struct Histograms;
  std::unique_ptr<Histograms> histograms_;
};

}  // namespace visual_localization
