#pragma once

#include <array>
#include <cstddef>

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

}  // namespace visual_localization
