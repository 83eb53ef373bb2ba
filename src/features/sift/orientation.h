#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "features/sift/extrema.h"
#include "features/sift/float_plane.h"

namespace visual_localization {

/// Finds the dominant directions of the gradients around a point (Lowe 2004, section 5).
class SiftOrientations {
 public:
  static constexpr int kBins = 36;

  /// Appends a copy of `point` for every peak of at least 0.8 of the highest, with the peak's angle. `level`: the
  /// blurred image that the point was found in.
  void assign(const FloatPlane& level, const SiftPoint& point, std::vector<SiftPoint>& oriented);

  /// Gradients of a few rows, and the histogram they are collected in.
  struct Workspace {
    GaussianWindow window;
    std::vector<std::int32_t> bins;
    AlignedFloats weights;
    std::array<float, kBins> histogram;  ///< bin i: around i * 10 degrees, counter-clockwise
  };

 private:
  Workspace work_;
};

}  // namespace visual_localization
