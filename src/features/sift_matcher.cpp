#include "visual_localization/features/sift_matcher.h"

#include <cmath>
#include <cstddef>

#include "base/statistics.h"
#include "features/nearest_descriptors.h"

namespace visual_localization {
namespace {

/// The last ratio's test: nearly always the only one of a program.
const AngleRatioTest& ratioTest(double max_angle_ratio) {
  static thread_local AngleRatioTest test(max_angle_ratio);
  if (test.maxAngleRatio() != max_angle_ratio) test = AngleRatioTest(max_angle_ratio);
  return test;
}

bool isDistinct(const TwoNearest& nearest, const AngleRatioTest& test) {
  return test.passes(nearest.best, nearest.second);
}

/// The neighbours in memory that is kept from call to call.
const NearestDescriptors& neighboursOf(const SiftFeatures& a, const SiftFeatures& b) {
  static thread_local NearestDescriptors nearest;
  findNearest(a, b, nearest);
  return nearest;
}

bool matchesBack(std::size_t i, const NearestDescriptors& nearest, const AngleRatioTest& test) {
  const TwoNearest& of_a = nearest.of_a[i];
  const TwoNearest& of_b = nearest.of_b[of_a.index];
  return of_b.index == i && isDistinct(of_a, test) && isDistinct(of_b, test);
}

template <class Use>
void forEachOneWay(const SiftFeatures& a, const SiftFeatures& b, double max_angle_ratio, Use use) {
  if (a.size() < 2 || b.size() < 2) return;
  const NearestDescriptors& nearest = neighboursOf(a, b);
  const AngleRatioTest& test = ratioTest(max_angle_ratio);
  for (std::size_t i = 0; i < a.size(); ++i) {
    if (isDistinct(nearest.of_a[i], test)) use(FeatureMatch{i, nearest.of_a[i].index});
  }
}

template <class Use>
void forEachSymmetric(const SiftFeatures& a, const SiftFeatures& b, double max_angle_ratio, Use use) {
  if (a.size() < 2 || b.size() < 2) return;
  const NearestDescriptors& nearest = neighboursOf(a, b);
  const AngleRatioTest& test = ratioTest(max_angle_ratio);
  for (std::size_t i = 0; i < a.size(); ++i) {
    if (matchesBack(i, nearest, test)) use(FeatureMatch{i, nearest.of_a[i].index});
  }
}

}  // namespace

void MatchConfig::declare(ParameterVisitor& visitor) {
  visitor.real({"match/max_angle_ratio", "1", "largest ratio of the angles to the nearest and second nearest (delta)"},
               max_angle_ratio, 0.1, 1.0);
  visitor.choice({"match/mode", "", "symmetric: both directions must agree (journal); one_way: test in training only"},
                 mode, {"symmetric", "one_way"});
}

std::vector<FeatureMatch> matchOneWay(const SiftFeatures& a, const SiftFeatures& b, double max_angle_ratio) {
  std::vector<FeatureMatch> matches;
  matchOneWay(a, b, max_angle_ratio, matches);
  return matches;
}

std::vector<FeatureMatch> matchSymmetric(const SiftFeatures& a, const SiftFeatures& b, double max_angle_ratio) {
  std::vector<FeatureMatch> matches;
  matchSymmetric(a, b, max_angle_ratio, matches);
  return matches;
}

void matchOneWay(const SiftFeatures& a, const SiftFeatures& b, double max_angle_ratio,
                 std::vector<FeatureMatch>& matches) {
  matches.clear();
  forEachOneWay(a, b, max_angle_ratio, [&matches](const FeatureMatch& match) { matches.push_back(match); });
}

void matchSymmetric(const SiftFeatures& a, const SiftFeatures& b, double max_angle_ratio,
                    std::vector<FeatureMatch>& matches) {
  matches.clear();
  forEachSymmetric(a, b, max_angle_ratio, [&matches](const FeatureMatch& match) { matches.push_back(match); });
}

void matchBy(const MatchConfig& config, const SiftFeatures& a, const SiftFeatures& b,
             std::vector<FeatureMatch>& matches) {
  if (config.isSymmetric()) {
    matchSymmetric(a, b, config.max_angle_ratio, matches);
  } else {
    matchOneWay(a, b, config.max_angle_ratio, matches);
  }
}

double medianScale(const SiftFeatures& a, const SiftFeatures& b, const std::vector<FeatureMatch>& matches) {
  static thread_local std::vector<float> scales;
  scales.clear();
  for (const FeatureMatch& match : matches) {
    const float scale = a.keypoints()[match.a].size_px / b.keypoints()[match.b].size_px;
    if (std::isfinite(scale) && scale > 0.0F) scales.push_back(scale);  // a map may claim any size
  }
  if (scales.empty()) return 1.0;
  return static_cast<double>(upperMedian(scales));
}

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
  static thread_local std::vector<FeatureMatch> matches;
  static thread_local std::vector<std::size_t> seen;
  matchOneWay(features, neighbour, max_angle_ratio, matches);
  seen.clear();
  for (const FeatureMatch& match : matches) seen.push_back(match.a);
  features.subset(seen, kept);
}

}  // namespace visual_localization
