#include "visual_localization/similarity/similarity.h"

#include <algorithm>

namespace visual_localization {

Score SiftSimilarity::compare(const ImageFeatures& current, const TrainingImage& training) const {
  const SiftFeatures& a = current.sift;
  const SiftFeatures& b = training.sift;
  if (a.size() < 2 || b.size() < 2) return {};
  const bool symmetric = config_.mode == "symmetric";
  const std::size_t matches =
      (symmetric ? matchSymmetric(a, b, config_.max_angle_ratio) : matchOneWay(a, b, config_.max_angle_ratio)).size();
  const std::size_t possible = symmetric ? std::min(a.size(), b.size()) : a.size();
  return {static_cast<double>(matches) / static_cast<double>(possible), matches};
}

}  // namespace visual_localization
