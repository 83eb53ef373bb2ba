#include "visual_localization/similarity/sift_similarity.h"

#include <algorithm>

namespace visual_localization {

SiftSimilarity::SiftSimilarity(const MatchConfig& match, const SimilarityConfig& config)
    : max_angle_ratio_(match.max_angle_ratio),
      symmetric_(match.mode == "symmetric"),
      recognised_(config.sift_recognised) {}

Score SiftSimilarity::compare(const SiftFeatures& current, const SiftFeatures& training) const {
  if (current.size() < 2 || training.size() < 2) return {};
  const std::size_t matches = symmetric_ ? countSymmetric(current, training, max_angle_ratio_)
                                         : countOneWay(current, training, max_angle_ratio_);
  const std::size_t possible = symmetric_ ? std::min(current.size(), training.size()) : current.size();
  return scoreOf(static_cast<double>(matches) / static_cast<double>(possible), matches);
}

Score SiftSimilarity::scoreOf(double similarity, std::size_t matches) const {
  return {similarity, similarity, matches, similarity >= recognised_};
}

}  // namespace visual_localization
