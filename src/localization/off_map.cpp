#include "localization/off_map.h"

#include <algorithm>
#include <cmath>

#include "base/numbers.h"

namespace visual_localization {
namespace {

// Chosen on maps of 60 % of ten drives, the whole drive live (doc/when_it_does_not_localise.md). None of the first
// eight is critical: half or twice of it changed TRACKING by at most 5 points, and no wrong claim.
constexpr double kLeaves = 0.002;       ///< an image, the robot leaves the path where it goes on
constexpr double kReturns = 0.02;       ///< an image, it comes back
constexpr double kOccluded = 0.1;       ///< images of the right place that match as by chance
constexpr double kAlike = 0.02;         ///< images of another place that match better than by chance
constexpr double kUsualGap = 1.5;       ///< of the right place above chance, before anything is known of it
constexpr double kUsualVariance = 1.0;  ///< likewise
constexpr double kUsualWeight = 2.0;    ///< likewise, images
constexpr double kUsualMemory = 30.0;   ///< images
constexpr double kChanceVariance = 0.06;
constexpr double kChanceWeight = 10.0;   ///< comparisons
constexpr double kChanceMemory = 200.0;  ///< comparisons
constexpr double kLeastChanceSigma = 0.15;
constexpr double kLeastUsualVariance = 0.04;

double normal(double deviation, double sigma) {
  constexpr double kInverseRootTwoPi = 0.3989422804014327;
  return kInverseRootTwoPi / sigma * gaussian(deviation, sigma);
}

}  // namespace

void RunningGaussian::add(double value, double value_weight, double most) {
  weight = std::min(weight + value_weight, most);
  if (!(weight > 0.0)) return;
  const double share = value_weight / weight;
  const double deviation = value - mean;
  mean += share * deviation;
  variance = (1.0 - share) * (variance + share * deviation * deviation);
}

void OffMapBelief::reset(double probability) {
  *this = {};
  probability_ = probability;
}

void OffMapBelief::predict(double leaving) {
  const double leaves = kLeaves + (1.0 - kLeaves) * std::clamp(leaving, 0.0, 1.0);
  probability_ = probability_ * (1.0 - kReturns) + (1.0 - probability_) * leaves;
}

double OffMapBelief::byChance(double log_matches) const {
  return normal(log_matches - chance_.mean, std::max(kLeastChanceSigma, std::sqrt(chance_.variance)));
}

/// Of a place that looks like the right one: anything from chance to what the right one matches.
double OffMapBelief::alike(double log_matches) const {
  constexpr double kTail = 0.3;
  const double above = log_matches - chance_.mean;
  const double range = std::max(usual_.mean - chance_.mean, 1.0);
  return above < 0.0 ? 0.0 : std::exp(-std::max(0.0, above - range) / kTail) / range;
}

/// Of the right place, which some people may hide. More matches than usual are no evidence against it.
double OffMapBelief::right(double log_matches) const {
  const double clear = normal(std::min(0.0, log_matches - usual_.mean), std::sqrt(usual_.variance));
  return (1.0 - kOccluded) * clear + kOccluded * byChance(log_matches);
}

/// Of being there over being anywhere else.
double OffMapBelief::likelihoodRatio(double log_matches) const {
  constexpr double kLeast = 1e-6;
  const double by_chance = (1.0 - kAlike) * byChance(log_matches) + kAlike * alike(log_matches);
  return right(log_matches) / (by_chance + kLeast);
}

/// The farther beyond, the fewer match: how far that is nobody knows.
double OffMapBelief::beyondRatio(double log_matches) const {
  constexpr double kMost = 1.0 / kOccluded;
  if (!knowsChance()) return 1.0;
  const double beyond = (1.0 - kOccluded) * alike(log_matches) + kOccluded * byChance(log_matches);
  return std::min(kMost, beyond / (right(log_matches) + 1e-6));
}

void OffMapBelief::update(const std::vector<Compared>& compared) {
  if (!knowsChance() || compared.empty()) return;
  double in_map = 1.0;  // a training image that it was not compared with speaks neither for nor against
  for (const Compared& one : compared) {
    const double there = likelihoodRatio(one.log_matches);
    in_map += one.predicted * (there - 1.0) + one.beyond * (beyondRatio(one.log_matches) * there - 1.0);
  }
  probability_ /= probability_ + (1.0 - probability_) * std::max(1e-9, in_map);
}

void OffMapBelief::learnChance(double log_matches) {
  if (!knowsChance()) {
    chance_ = {log_matches, kChanceVariance, kChanceWeight};
    if (usual_.weight == 0.0) usual_ = {log_matches + kUsualGap, kUsualVariance, kUsualWeight};
  } else {
    chance_.add(log_matches, 1.0, kChanceMemory);
  }
}

void OffMapBelief::learnUsual(double log_matches, double certainty) {
  usual_.add(log_matches, (1.0 - probability_) * certainty, kUsualMemory);
  usual_.variance = std::max(kLeastUsualVariance, usual_.variance);
}

}  // namespace visual_localization
