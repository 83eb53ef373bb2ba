#pragma once

#include <cstdint>

#include "visual_localization/features/float_plane.h"
#include "visual_localization/features/gaussian_window.h"
#include "visual_localization/features/sift_point.h"

namespace visual_localization {

/// Describes points by histograms of the gradients around them (Lowe 2004, section 6): 4 x 4 cells of 3 sigma x
/// 3 sigma, turned by the point's angle, with 8 directions each.
class SiftDescriber {
 public:
  /// Writes 128 bytes, a vector of length 512 whose elements were clipped at 0.2 of its length. `level`: the blurred
  /// image that the point was found in.
  void describe(const FloatPlane& level, const SiftPoint& point, std::uint8_t* descriptor);

  /// What a pixel adds to the histograms, for up to kSamples pixels and a row more.
  struct Workspace {
    static constexpr int kSamples = 1024;
    GaussianWindow window;
    AlignedFloats cells;       ///< int32: first of the 8 bins of the upper left of the four cells around the pixel
    AlignedFloats directions;  ///< in bins, [0, 8]
    AlignedFloats weights[4];  ///< in the upper left, upper right, lower left and lower right cell
    AlignedFloats histograms;
  };

 private:
  Workspace work_;
};

}  // namespace visual_localization
