#include "visual_localization/localization/state.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>

#include "base/time.h"
#include "visual_localization/parameters/parameters.h"

namespace visual_localization {
namespace {

/// A short vector is moved sooner than memory is found for a list.
template <class Value>
void keepLast(std::size_t count, std::vector<Value>& values) {
  if (values.size() > count) values.erase(values.begin(), values.end() - static_cast<std::ptrdiff_t>(count));
}

}  // namespace

std::string toString(LocalizationState state) {
  switch (state) {
    case LocalizationState::kNoMap:
      return "NO_MAP";
    case LocalizationState::kInitializing:
      return "INITIALIZING";
    case LocalizationState::kTracking:
      return "TRACKING";
    case LocalizationState::kUncertain:
      return "UNCERTAIN";
    case LocalizationState::kRecovering:
      return "RECOVERING";
    case LocalizationState::kOffMap:
      return "OFF_MAP";
  }
  return "UNKNOWN";
}

void MotionConsistency::add(std::int64_t stamp_ns, const Eigen::Vector2d& position_m) {
  points_.push_back({stamp_ns, position_m});
  if (points_.size() > length_) points_.erase(points_.begin());
}

double MotionConsistency::residual_m() const {
  if (points_.size() < 3) return 0.0;
  const bool timed = stampsRise();
  const auto count = static_cast<double>(points_.size());
  const auto timeOf = [&](std::size_t i) {
    // From the first image on: differences of stamps are exact, stamps as double would not be.
    return timed ? secondsBetween(points_[0].stamp_ns, points_[i].stamp_ns) : static_cast<double>(i);
  };
  double mean_time = 0.0;
  Eigen::Vector2d mean_m = Eigen::Vector2d::Zero();
  for (std::size_t i = 0; i < points_.size(); ++i) {
    mean_time += timeOf(i) / count;
    mean_m += points_[i].position_m / count;
  }
  double times = 0.0;
  Eigen::Vector2d products = Eigen::Vector2d::Zero();
  double squares = 0.0;
  for (std::size_t i = 0; i < points_.size(); ++i) {
    const double time = timeOf(i) - mean_time;
    const Eigen::Vector2d offset = points_[i].position_m - mean_m;
    times += time * time;
    products += time * offset;
    squares += offset.squaredNorm();
  }
  return std::sqrt(std::max(0.0, squares - products.squaredNorm() / times) / count);
}

bool MotionConsistency::stampsRise() const {
  const auto falls = [](const Point& a, const Point& b) { return b.stamp_ns <= a.stamp_ns; };
  return std::adjacent_find(points_.begin(), points_.end(), falls) == points_.end();
}

void StateConfig::declare(ParameterVisitor& visitor) {
  visitor.choice(
      {"state/witness", "",
       "what tells TRACKING without landmarks: the probability around the estimate, by a filter over the "
       "training images beside any tracker, or thresholds on the similarity; for global features always these"},
      witness, {"probability", "similarity"});
  visitor.real({"state/min_probability", "1", "a lower probability around the estimate does not confirm it"},
               min_probability, 0.5, 1.0);
  visitor.real(
      {"state/max_scale", "1",
       "a median size ratio of the matched local features above this, or below its inverse, does not confirm a "
       "position"},
      max_scale, 1.0, 100.0);
  visitor.flag({"state/place_check", "", "ask the global features whether another place of the map looks more alike"},
               place_check);
  visitor.real({"state/max_motion_residual", "m",
                "up to this root mean square distance the last ten estimates must follow a steady motion"},
               max_motion_residual_m, 0.0, 10000.0);
  visitor.integer(
      {"state/frozen_images", "1",
       "this number of repetitions of an image to the last bit, over a second, ends TRACKING; 0: never, for a "
       "simulated camera without noise"},
      frozen_images, 0, 100000);
}

void StateAssessor::reset() { *this = StateAssessor(config_); }

LocalizationState StateAssessor::doubt(bool recovering) {
  forget();
  return stateOf(false, recovering);
}

LocalizationState StateAssessor::update(std::int64_t stamp_ns, const TrackerEstimate& estimate,
                                        const Evidence& evidence) {
  remember(stamp_ns, estimate, evidence);
  const bool verified = evidence.verified.value_or(false);
  const bool confirmed = verified || (evidence.probability ? lastConfirms() : !evidence.verified && isCertain());
  const bool certain = confirmed && !evidence.vague;
  ever_confirmed_ = ever_confirmed_ || certain;
  // Matched local features are of a mapped place, even while the position is not certain.
  const bool sees_map =
      evidence.features == FeatureKind::kLocal && (evidence.probability ? estimate.best.recognised : lastConfirms());
  if (certain) unconfirmed_ = 0;
  if (!certain && !evidence.blind && !sees_map) unconfirmed_ = std::min(unconfirmed_ + 1, config_.off_map_images);
  const bool decided = evidence.verified || evidence.probability;
  return stateOf(certain, estimate.recovering && !(decided && certain));
}

LocalizationState StateAssessor::stateOf(bool certain, bool recovering) const {
  if (unconfirmed_ >= config_.off_map_images) return LocalizationState::kOffMap;
  if (recovering) return LocalizationState::kRecovering;
  if (certain) return LocalizationState::kTracking;
  return ever_confirmed_ ? LocalizationState::kUncertain : LocalizationState::kInitializing;
}

void StateAssessor::remember(std::int64_t stamp_ns, const TrackerEstimate& estimate, const Evidence& evidence) {
  if (last_position_m_ && (estimate.position_m - *last_position_m_).norm() > config_.max_step_m) forget();
  last_position_m_ = estimate.position_m;
  motion_.add(stamp_ns, estimate.position_m);
  confirmations_.push_back(confirms(estimate, evidence) ? 1 : 0);
  place_ratios_.push_back(evidence.place_ratio);
  const auto window = static_cast<std::size_t>(config_.window);
  keepLast(window, confirmations_);
  keepLast(window, place_ratios_);
}

void StateAssessor::forget() {
  confirmations_.clear();
  place_ratios_.clear();
  motion_.clear();
}

bool StateAssessor::isCertain() const {
  const auto confirmed = std::count(confirmations_.begin(), confirmations_.end(), 1);
  return confirmed >= config_.images_to_confirm && !isDoubtful() &&
         motion_.residual_m() <= config_.max_motion_residual_m;
}

bool StateAssessor::isDoubtful() const {
  if (place_ratios_.empty()) return false;
  const double sum = std::accumulate(place_ratios_.begin(), place_ratios_.end(), 0.0);
  return sum < config_.min_place_ratio * static_cast<double>(place_ratios_.size());
}

bool StateAssessor::confirms(const TrackerEstimate& estimate, const Evidence& evidence) const {
  if (evidence.probability) return *evidence.probability >= config_.min_probability;
  if (estimate.best_distance_m > config_.max_distance_m) return false;
  if (evidence.features == FeatureKind::kGlobal) return estimate.best.similarity >= config_.min_global_similarity;
  return estimate.best.similarity >= config_.min_similarity &&
         estimate.best.matches >= static_cast<std::size_t>(config_.min_matches) &&
         estimate.best.scale <= config_.max_scale && estimate.best.scale * config_.max_scale >= 1.0;
}

}  // namespace visual_localization
