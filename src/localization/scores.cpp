#include "visual_localization/localization/scores.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "base/time.h"
#include "visual_localization/features/global_features.h"
#include "visual_localization/localization/score.h"

namespace visual_localization {

std::string toString(FeatureKind kind) { return kind == FeatureKind::kSift ? "SIFT" : "GLOBAL"; }

void SimilarityConfig::declare(ParameterVisitor& visitor) {
  visitor.real({"similarity/sift_recognised", "1", "a best match below this share of the features is a bad one"},
               sift_recognised, 0.0, 1.0);
  visitor.real({"similarity/global_recognised", "1", "a best global similarity below this is a bad one"},
               global_recognised, 0.0, 1.0);
  visitor.real({"similarity/global_exponent", "1", "a global similarity is raised to this to become a weight"},
               global_exponent, 1.0, 1000.0);
}

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

Score GlobalSimilarity::compare(const GlobalFeatures& current, const GlobalFeatures& training) const {
  return scoreOf(histogramIntersection(current.wgoh, training.wgoh) *
                 histogramIntersection(current.wgii, training.wgii));
}

Score GlobalSimilarity::scoreOf(double similarity) const {
  return {similarity, std::pow(similarity, config_.global_exponent), 0, similarity >= config_.global_recognised};
}

void ScoreCache::startImage(Compare compare) {
  compare_ = std::move(compare);
  entries_.clear();
}

Score ScoreCache::operator[](std::size_t training_image) {
  std::uint32_t& entry = entry_of_.at(training_image);
  if (entry < entries_.size() && entries_[entry].training_image == training_image) return entries_[entry].score;
  const Score score = compare_(training_image);
  entry = static_cast<std::uint32_t>(entries_.size());
  entries_.push_back({training_image, score});
  return score;
}

Score LiveImage::compare(FeatureKind kind, std::size_t training_image) {
  // What the map must read from its file counts as comparing: without the comparison there would be no need.
  if (kind == FeatureKind::kSift) {
    const SiftFeatures& current = front_end_.sift();
    const Stopwatch stopwatch;
    const Score score = sift_.compare(current, *map_.sift(training_image));
    match_ms_ += stopwatch.elapsed_ms();
    return score;
  }
  const GlobalFeatures& current = front_end_.global();
  const Stopwatch stopwatch;
  const Score score = global_.compare(current, *map_.global(training_image));
  match_ms_ += stopwatch.elapsed_ms();
  return score;
}

}  // namespace visual_localization
