#include "visual_localization/localization/similarity.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

namespace visual_localization {

void SimilarityConfig::declare(ParameterVisitor& visitor) {
  visitor.real({"similarity/sift_recognised", "1",
                "a best match below this share of the features is a bad one (journal, section 5)"},
               sift_recognised, 0.0, 1.0);
}

LocalSimilarity::LocalSimilarity(const MatchConfig& match, const SimilarityConfig& config, int image_width_px,
                                 std::shared_ptr<const LocalFeatureKind> kind)
    : kind_(std::move(kind)),
      match_(match),
      recognised_(config.recognised(FeatureKind::kLocal, match)),
      exponent_(config.exponent(FeatureKind::kLocal, match)),
      image_width_px_(image_width_px) {}

Score LocalSimilarity::compare(const LocalFeatures& current, const LocalFeatures& training) const {
  if (current.size() < 2 || training.size() < 2) return {};
  static thread_local std::vector<FeatureMatch> matches;
  kind_->match(match_, current, training, image_width_px_, matches);
  const std::size_t possible = match_.isOneWay() ? current.size() : std::min(current.size(), training.size());
  return scoreOf(static_cast<double>(matches.size()) / static_cast<double>(possible), matches.size(),
                 medianScale(current, training, matches));
}

Score LocalSimilarity::scoreOf(double similarity, std::size_t matches, double scale) const {
  return {similarity, std::pow(similarity, exponent_), matches, similarity >= recognised_, scale};
}

Score GlobalSimilarity::compare(const GlobalFeatures& current, const GlobalFeatures& training) const {
  return scoreOf(histogramIntersection(current.wgoh, training.wgoh) *
                 histogramIntersection(current.wgii, training.wgii));
}

Score GlobalSimilarity::scoreOf(double similarity) const {
  return {similarity, std::pow(similarity, config_.global_exponent), 0, similarity >= config_.global_recognised};
}

}  // namespace visual_localization
