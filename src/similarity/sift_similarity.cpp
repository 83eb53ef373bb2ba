#include "visual_localization/similarity/sift_similarity.h"

#include <algorithm>
#include <vector>

namespace visual_localization {

SiftSimilarity::SiftSimilarity(const MatchConfig& match, const SimilarityConfig& config)
    : max_angle_ratio_(match.max_angle_ratio),
      symmetric_(match.mode == "symmetric"),
      recognised_(config.sift_recognised) {}

Score SiftSimilarity::compare(const SiftFeatures& current, const SiftFeatures& training) const {
  if (current.size() < 2 || training.size() < 2) return {};
  static thread_local std::vector<FeatureMatch> matches;
  if (symmetric_) {
    matchSymmetric(current, training, max_angle_ratio_, matches);
  } else {
    matchOneWay(current, training, max_angle_ratio_, matches);
  }
  const std::size_t possible = symmetric_ ? std::min(current.size(), training.size()) : current.size();
  return scoreOf(static_cast<double>(matches.size()) / static_cast<double>(possible), matches.size(),
                 medianScale(current, training, matches));
}

Score SiftSimilarity::scoreOf(double similarity, std::size_t matches, double scale) const {
  return {similarity, similarity, matches, similarity >= recognised_, scale};
}

}  // namespace visual_localization
