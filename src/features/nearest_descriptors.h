#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "visual_localization/features/local_features.h"

namespace visual_localization {

/// The two descriptors of another image that are nearest to one descriptor.
struct TwoNearest {
  float best = -1.0F;       ///< cosine of the angle to the nearest
  float second = -1.0F;     ///< the same to the second nearest; of two that are equally near, both are the cosine
  std::uint32_t index = 0;  ///< of the nearest; the first of equals
};

/// The two nearest neighbours of every descriptor, in both directions.
struct NearestDescriptors {
  std::vector<TwoNearest> of_a;  ///< in B
  std::vector<TwoNearest> of_b;  ///< in A
};

/// Dimension of descriptors of bytes, SIFT's, for which vectors are used.
constexpr std::size_t kPackedBytes = 128;

/// Throws std::invalid_argument unless their descriptors are of one form, or one of them has none.
void requireAlike(const LocalFeatures& a, const LocalFeatures& b);

/// Compares every descriptor of `a` with every one of `b`, once for both directions. Cosines are
/// float(<a, b>) * (1 / |a|) * (1 / |b|), the zero vector orthogonal to everything. The scalar product of bytes is
/// taken in integers: the same number on every CPU; that of floats to their rounding. Uses the widest vectors that the
/// CPU has (chosen at run time). Throws like requireAlike.
void findNearest(const LocalFeatures& a, const LocalFeatures& b, NearestDescriptors& nearest);

/// The nearest alone, of those whose row in the image is at most `max_dy_px` away: `best` is -1 where there is none,
/// and `second` nothing. Of equals the first in orderByRow(). Bytes are halved, rounded down: the products of two pairs
/// fit into 16 bits then, and vectors without VNNI take twice as many.
void findNearestWithin(const LocalFeatures& a, const LocalFeatures& b, float max_dy_px, NearestDescriptors& nearest);

/// The same without vectors: what they are tested against, and stands in for them where Highway is missing.
void findNearestPlain(const LocalFeatures& a, const LocalFeatures& b, NearestDescriptors& nearest);
void findNearestWithinPlain(const LocalFeatures& a, const LocalFeatures& b, float max_dy_px,
                            NearestDescriptors& nearest);

/// The indices of the features in strips of the image from its top to its bottom, where they keep their order.
void orderByRow(const LocalFeatures& features, std::vector<std::uint32_t>& order);

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
