#include "visual_localization/features/pruning.h"

#include <cstddef>

#include "visual_localization/features/sift_matcher.h"

namespace visual_localization {

SiftFeatures keepSeenIn(const SiftFeatures& features, const std::vector<const SiftFeatures*>& neighbours,
                        double max_angle_ratio) {
  std::vector<bool> seen(features.size(), false);
  for (const SiftFeatures* neighbour : neighbours) {
    for (const FeatureMatch& match : matchOneWay(features, *neighbour, max_angle_ratio)) seen[match.a] = true;
  }
  std::vector<std::size_t> kept;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    if (seen[i]) kept.push_back(i);
  }
  return features.subset(kept);
}

void keepSeenIn(const SiftFeatures& features, const SiftFeatures& neighbour, double max_angle_ratio,
                SiftFeatures& kept) {
  static thread_local std::vector<std::size_t> seen;
  matchOneWay(features, neighbour, max_angle_ratio, seen);
  features.subset(seen, kept);
}

}  // namespace visual_localization
