#include "visual_localization/features/feature_matcher.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numeric>
#include <stdexcept>

#include "base/numbers.h"
#include "features/displacement_votes.h"
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
const NearestDescriptors& neighboursOf(const LocalFeatures& a, const LocalFeatures& b) {
  static thread_local NearestDescriptors nearest;
  findNearest(a, b, nearest);
  return nearest;
}

bool matchesBack(std::uint32_t i, const NearestDescriptors& nearest, const AngleRatioTest& test) {
  const TwoNearest& of_a = nearest.of_a[i];
  const TwoNearest& of_b = nearest.of_b[of_a.index];
  return of_b.index == i && isDistinct(of_a, test) && isDistinct(of_b, test);
}

template <class Use>
void forEachOneWay(const LocalFeatures& a, const LocalFeatures& b, double max_angle_ratio, Use use) {
  if (a.size() < 2 || b.size() < 2) return;
  const NearestDescriptors& nearest = neighboursOf(a, b);
  const AngleRatioTest& test = ratioTest(max_angle_ratio);
  for (std::uint32_t i = 0; i < a.size(); ++i) {
    if (isDistinct(nearest.of_a[i], test)) use(FeatureMatch{i, nearest.of_a[i].index});
  }
}

template <class Use>
void forEachSymmetric(const LocalFeatures& a, const LocalFeatures& b, double max_angle_ratio, Use use) {
  if (a.size() < 2 || b.size() < 2) return;
  const NearestDescriptors& nearest = neighboursOf(a, b);
  const AngleRatioTest& test = ratioTest(max_angle_ratio);
  for (std::uint32_t i = 0; i < a.size(); ++i) {
    if (matchesBack(i, nearest, test)) use(FeatureMatch{i, nearest.of_a[i].index});
  }
}

float product(const LocalFeatures& a, std::size_t i, const LocalFeatures& b, std::size_t j) {
  const std::size_t dimension = a.form().dimension;
  if (a.form().element == DescriptorElement::kFloat) {
    return std::inner_product(a.floats(i), a.floats(i) + dimension, b.floats(j), 0.0F);
  }
  return static_cast<float>(std::inner_product(a.bytes(i), a.bytes(i) + dimension, b.bytes(j), std::int32_t{0}));
}

/// Its bytes halved, if it has bytes.
LocalFeatures halved(const LocalFeatures& features) {
  if (features.form().element == DescriptorElement::kFloat) return features;
  std::vector<std::uint8_t> bytes = features.bytes();
  for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(byte >> 1);
  return LocalFeatures(features.keypoints(), std::move(bytes));
}

void offer(TwoNearest& nearest, float cosine, std::size_t candidate) {
  if (cosine > nearest.best) {
    nearest = {cosine, nearest.best, static_cast<std::uint32_t>(candidate)};
  } else if (cosine > nearest.second) {
    nearest.second = cosine;
  }
}

}  // namespace

void MatchConfig::declare(ParameterVisitor& visitor) {
  visitor.real({"match/max_angle_ratio", "1", "largest ratio of the angles to the nearest and second nearest (delta)"},
               max_angle_ratio, 0.1, 1.0);
  visitor.choice({"match/mode", "",
                  "votes: nearest neighbours in both directions that moved alike across the picture; symmetric: both "
                  "directions must pass the ratio test (journal); one_way: test in training only"},
                 mode, {"votes", "symmetric", "one_way"});
}

std::vector<FeatureMatch> matchOneWay(const LocalFeatures& a, const LocalFeatures& b, double max_angle_ratio) {
  std::vector<FeatureMatch> matches;
  matchOneWay(a, b, max_angle_ratio, matches);
  return matches;
}

std::vector<FeatureMatch> matchSymmetric(const LocalFeatures& a, const LocalFeatures& b, double max_angle_ratio) {
  std::vector<FeatureMatch> matches;
  matchSymmetric(a, b, max_angle_ratio, matches);
  return matches;
}

void matchOneWay(const LocalFeatures& a, const LocalFeatures& b, double max_angle_ratio,
                 std::vector<FeatureMatch>& matches) {
  matches.clear();
  forEachOneWay(a, b, max_angle_ratio, [&matches](const FeatureMatch& match) { matches.push_back(match); });
}

void matchSymmetric(const LocalFeatures& a, const LocalFeatures& b, double max_angle_ratio,
                    std::vector<FeatureMatch>& matches) {
  matches.clear();
  forEachSymmetric(a, b, max_angle_ratio, [&matches](const FeatureMatch& match) { matches.push_back(match); });
}

void matchMutual(const LocalFeatures& a, const LocalFeatures& b, double max_dy_px, std::vector<FeatureMatch>& matches) {
  matches.clear();
  if (a.size() < 2 || b.size() < 2) return;
  static thread_local NearestDescriptors kept;
  NearestDescriptors& nearest = kept;
  findNearestWithin(a, b, static_cast<float>(max_dy_px), nearest);
  for (std::uint32_t i = 0; i < a.size(); ++i) {
    const std::uint32_t partner = nearest.of_a[i].index;
    if (nearest.of_a[i].best >= 0.0F && nearest.of_b[partner].index == i) matches.push_back({i, partner});
  }
}

void matchBy(const MatchConfig& config, const LocalFeatures& a, const LocalFeatures& b, double image_width_px,
             double vote_rows, std::vector<FeatureMatch>& matches) {
  if (config.isByVotes()) {
    matchMutual(a, b, vote_rows * image_width_px, matches);
    keepLargestVote(a, b, image_width_px, matches);
  } else if (config.isOneWay()) {
    matchOneWay(a, b, config.max_angle_ratio, matches);
  } else {
    matchSymmetric(a, b, config.max_angle_ratio, matches);
  }
}

double medianScale(const LocalFeatures& a, const LocalFeatures& b, const std::vector<FeatureMatch>& matches) {
  static thread_local std::vector<float> scales;
  scales.clear();
  for (const FeatureMatch& match : matches) {
    const float scale = a.keypoints()[match.a].size_px / b.keypoints()[match.b].size_px;
    if (std::isfinite(scale) && scale > 0.0F) scales.push_back(scale);  // a map may claim any size
  }
  if (scales.empty()) return 1.0;
  return static_cast<double>(upperMedian(scales));
}

std::vector<std::size_t> seenIn(const LocalFeatures& features, const std::vector<const LocalFeatures*>& neighbours,
                                double max_angle_ratio) {
  std::vector<bool> seen(features.size(), false);
  for (const LocalFeatures* neighbour : neighbours) {
    for (const FeatureMatch& match : matchOneWay(features, *neighbour, max_angle_ratio)) seen[match.a] = true;
  }
  std::vector<std::size_t> kept;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    if (seen[i]) kept.push_back(i);
  }
  return kept;
}

LocalFeatures keepSeenIn(const LocalFeatures& features, const std::vector<const LocalFeatures*>& neighbours,
                         double max_angle_ratio) {
  return features.subset(seenIn(features, neighbours, max_angle_ratio));
}

void keepSeenIn(const LocalFeatures& features, const LocalFeatures& neighbour, double max_angle_ratio,
                LocalFeatures& kept) {
  static thread_local std::vector<FeatureMatch> matches;
  static thread_local std::vector<std::size_t> seen;
  matchOneWay(features, neighbour, max_angle_ratio, matches);
  seen.clear();
  for (const FeatureMatch& match : matches) seen.push_back(match.a);
  features.subset(seen, kept);
}

void requireAlike(const LocalFeatures& a, const LocalFeatures& b) {
  if (a.empty() || b.empty() || a.form() == b.form()) return;
  throw std::invalid_argument("local features with descriptors of different forms cannot be compared");
}

void findNearestPlain(const LocalFeatures& a, const LocalFeatures& b, NearestDescriptors& nearest) {
  requireAlike(a, b);
  nearest.of_a.assign(a.size(), TwoNearest());
  nearest.of_b.assign(b.size(), TwoNearest());
  for (std::size_t i = 0; i < a.size(); ++i) {
    for (std::size_t j = 0; j < b.size(); ++j) {
      const float cosine = product(a, i, b, j) * a.inverseNorm(i) * b.inverseNorm(j);
      offer(nearest.of_a[i], cosine, j);
      offer(nearest.of_b[j], cosine, i);
    }
  }
}

void findNearestWithinPlain(const LocalFeatures& all_a, const LocalFeatures& all_b, float max_dy_px,
                            NearestDescriptors& nearest) {
  requireAlike(all_a, all_b);
  const LocalFeatures a = halved(all_a);
  const LocalFeatures b = halved(all_b);
  nearest.of_a.assign(a.size(), TwoNearest());
  nearest.of_b.assign(b.size(), TwoNearest());
  std::vector<std::uint32_t> order_a;
  std::vector<std::uint32_t> order_b;
  orderByRow(a, order_a);
  orderByRow(b, order_b);
  for (const std::uint32_t i : order_a) {
    for (const std::uint32_t j : order_b) {
      if (!(std::abs(a.keypoints().y_px()[i] - b.keypoints().y_px()[j]) <= max_dy_px)) continue;
      const float cosine = product(a, i, b, j) * a.inverseNorm(i) * b.inverseNorm(j);
      if (cosine > nearest.of_a[i].best) nearest.of_a[i] = {cosine, -1.0F, j};
      if (cosine > nearest.of_b[j].best) nearest.of_b[j] = {cosine, -1.0F, i};
    }
  }
}

void orderByRow(const LocalFeatures& features, std::vector<std::uint32_t>& order) {
  constexpr std::size_t kStrips = 256;
  constexpr float kStrip_px = 8.0F;  // a map may claim any row: what lies outside is in the first or the last strip
  const std::vector<float>& y_px = features.keypoints().y_px();
  const auto strip = [](float y) {
    return y > 0.0F ? static_cast<std::size_t>(std::min(y / kStrip_px, kStrips - 1.0F)) : 0;
  };
  std::array<std::uint32_t, kStrips + 1> begins{};
  for (const float y : y_px) ++begins[strip(y) + 1];
  std::partial_sum(begins.begin(), begins.end(), begins.begin());
  order.resize(y_px.size());
  for (std::uint32_t i = 0; i < y_px.size(); ++i) order[begins[strip(y_px[i])]++] = i;
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
void findNearest(const LocalFeatures& a, const LocalFeatures& b, NearestDescriptors& nearest) {
  findNearestPlain(a, b, nearest);
}

void findNearestWithin(const LocalFeatures& a, const LocalFeatures& b, float max_dy_px, NearestDescriptors& nearest) {
  findNearestWithinPlain(a, b, max_dy_px, nearest);
}
#endif

}  // namespace visual_localization
