#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace visual_localization {

/// Whether the angle to the nearest descriptor is below a share of the angle to the second nearest, from the cosines
/// of both: acos(best) < max_angle_ratio * acos(second). The angles are taken only when a table of bounds does not
/// decide, and then exactly.
class AngleRatioTest {
 public:
  explicit AngleRatioTest(double max_angle_ratio);

  double maxAngleRatio() const { return max_angle_ratio_; }

  bool passes(float best, float second) const {
    // Rounding may lift a cosine above one.
    const double next = static_cast<double>(std::clamp(second, 0.0F, 1.0F));
    const double nearest = static_cast<double>(std::min(best, 1.0F));
    const std::size_t cell = std::min(kCells - 1, static_cast<std::size_t>(next * kCells));
    if (nearest <= bounds_[cell] - kMargin) return false;
    if (nearest > bounds_[cell + 1] + kMargin) return true;
    return exactly(best, second);
  }

 private:
  static constexpr std::size_t kCells = 1024;
  static constexpr double kMargin = 1e-9;  ///< far above the rounding of acos and cos

  bool exactly(float best, float second) const;

  double max_angle_ratio_;
  std::array<double, kCells + 1> bounds_{};  ///< cos(max_angle_ratio * acos(second)), which grows with `second`
};

}  // namespace visual_localization
