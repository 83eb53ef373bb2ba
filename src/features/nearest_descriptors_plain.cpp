#include <algorithm>
#include <cmath>
#include <numeric>

#include "features/nearest_descriptors.h"

namespace visual_localization {
namespace {

void offer(TwoNearest& nearest, float cosine, std::size_t candidate) {
  if (cosine > nearest.best) {
    nearest = {cosine, nearest.best, static_cast<std::uint32_t>(candidate)};
  } else if (cosine > nearest.second) {
    nearest.second = cosine;
  }
}

}  // namespace

void findNearestPlain(const SiftFeatures& a, const SiftFeatures& b, NearestDescriptors& nearest) {
  nearest.of_a.assign(a.size(), TwoNearest());
  nearest.of_b.assign(b.size(), TwoNearest());
  for (std::size_t i = 0; i < a.size(); ++i) {
    for (std::size_t j = 0; j < b.size(); ++j) {
      const std::int32_t product =
          std::inner_product(a.descriptor(i), a.descriptor(i) + SiftFeatures::kDescriptorSize, b.descriptor(j), 0);
      const float cosine = static_cast<float>(product) * a.inverseNorm(i) * b.inverseNorm(j);
      offer(nearest.of_a[i], cosine, j);
      offer(nearest.of_b[j], cosine, i);
    }
  }
}

AngleRatioTest::AngleRatioTest(double max_angle_ratio) : max_angle_ratio_(max_angle_ratio) {
  for (std::size_t i = 0; i <= kCells; ++i) {
    bounds_[i] = std::cos(max_angle_ratio * std::acos(static_cast<double>(i) / kCells));
  }
}

bool AngleRatioTest::exactly(float best, float second) const {
  const double nearest = std::acos(std::min(1.0, static_cast<double>(best)));
  const double next = std::acos(std::min(1.0, static_cast<double>(second)));
  return nearest < max_angle_ratio_ * next;
}

#ifndef VISUAL_LOCALIZATION_HIGHWAY
void findNearest(const SiftFeatures& a, const SiftFeatures& b, NearestDescriptors& nearest) {
  findNearestPlain(a, b, nearest);
}
#endif

}  // namespace visual_localization
