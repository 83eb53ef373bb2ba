#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "features/sift/extrema.h"
#include "features/sift/scale_space.h"
#include "visual_localization/features/sift.h"

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

/// Describes points by histograms of the gradients around them (Lowe 2004, section 6): 4 x 4 cells of 3 sigma x
/// 3 sigma, turned by the point's angle, with 8 directions each.
class SiftDescriber {
 public:
  /// `hellinger`: see SiftConfig.
  explicit SiftDescriber(bool hellinger = false) : hellinger_(hellinger) {}

  /// Writes 128 bytes, a vector of length 512 whose elements were clipped at 0.2 of its length, or the square roots of
  /// such elements, again of length 512. `level`: the blurred image that the point was found in.
  void describe(const FloatPlane& level, const SiftPoint& point, std::uint8_t* descriptor);

  /// What pixels add to the histograms.
  struct Samples {
    static constexpr int kCapacity = 512;
    static constexpr int kSpace = kCapacity + 16;  ///< whole vectors are written
    alignas(64) std::int32_t bins[kSpace];         ///< first one of the upper left of the four cells around the pixel
    alignas(64) float directions[kSpace];          ///< in bins, [0, 8]
    alignas(64) float upper_left[kSpace];          ///< weight in that cell
    alignas(64) float upper_right[kSpace];
    alignas(64) float lower_left[kSpace];
    alignas(64) float lower_right[kSpace];
  };

  struct Workspace {
    GaussianWindow window;
    Samples samples;
  };

 private:
  bool hellinger_;
  Workspace work_;
};

}  // namespace visual_localization
