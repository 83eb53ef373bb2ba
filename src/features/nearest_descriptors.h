#pragma once

#include <cstdint>
#include <vector>

#include "visual_localization/features/sift_features.h"

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

/// Compares every descriptor of `a` with every one of `b`, once for both directions. Cosines are
/// float(<a, b>) * (1 / |a|) * (1 / |b|) with the scalar product in integers, the zero vector orthogonal to
/// everything: the same number on every CPU. Uses the widest vectors that the CPU has (chosen at run time).
void findNearest(const SiftFeatures& a, const SiftFeatures& b, NearestDescriptors& nearest);

/// The same without vectors: what findNearest is tested against, and stands in for it where Highway is missing.
void findNearestPlain(const SiftFeatures& a, const SiftFeatures& b, NearestDescriptors& nearest);

}  // namespace visual_localization
