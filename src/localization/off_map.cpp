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

/// Of being there over being anywhere else.
double OffMapBelief::likelihoodRatio(double log_matches) const {
  constexpr double kTail = 0.3;
  constexpr double kLeast = 1e-6;
  const double above = log_matches - chance_.mean;
  const double by_chance = normal(above, std::max(kLeastChanceSigma, std::sqrt(chance_.variance)));
  const double range = std::max(usual_.mean - chance_.mean, 1.0);
  const double alike = above < 0.0 ? 0.0 : std::exp(-std::max(0.0, above - range) / kTail) / range;
  // More matches than usual are no evidence against the place.
  const double right = normal(std::min(0.0, log_matches - usual_.mean), std::sqrt(usual_.variance));
  return ((1.0 - kOccluded) * right + kOccluded * by_chance) / ((1.0 - kAlike) * by_chance + kAlike * alike + kLeast);
}

void OffMapBelief::update(const std::vector<Compared>& compared) {
  if (!knowsChance() || compared.empty()) return;
  double in_map = 1.0;  // a training image that it was not compared with speaks neither for nor against
  for (const Compared& one : compared) in_map += one.predicted * (likelihoodRatio(one.log_matches) - 1.0);
  probability_ /= probability_ + (1.0 - probability_) * std::max(1e-9, in_map);
}

void OffMapBelief::learnChance(double log_matches) {
  if (!knowsChance()) {
    chance_ = {log_matches, kChanceVariance, kChanceWeight};
    usual_ = {log_matches + kUsualGap, kUsualVariance, kUsualWeight};
  } else {
    chance_.add(log_matches, 1.0, kChanceMemory);
  }
}

void OffMapBelief::learnUsual(double log_matches, double certainty) {
  if (!knowsChance()) return;
  usual_.add(log_matches, (1.0 - probability_) * certainty, kUsualMemory);
  usual_.variance = std::max(kLeastUsualVariance, usual_.variance);
}

}  // namespace visual_localization
