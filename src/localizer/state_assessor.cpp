#include "visual_localization/localizer/state_assessor.h"

#include <algorithm>

namespace visual_localization {

void StateConfig::declare(ParameterVisitor& visitor) {
  visitor.real({"state/min_similarity", "1", "a weaker best match by SIFT does not confirm a position"}, min_similarity,
               0.0, 1.0);
  visitor.integer({"state/min_matches", "1", "fewer matched SIFT features are no evidence, whatever their share"},
                  min_matches, 0, 10000);
  visitor.real(
      {"state/min_global_similarity", "1", "a weaker best match by global features does not confirm a position"},
      min_global_similarity, 0.0, 1.0);
  visitor.real({"state/max_distance", "m", "a best match farther from the estimate does not confirm it"},
               max_distance_m, 0.1, 10000.0);
  visitor.integer({"state/window", "1", "how many of the last images decide about the state"}, window, 1, 1000);
  visitor.integer({"state/images_to_confirm", "1", "how many of them must confirm the position for TRACKING"},
                  images_to_confirm, 1, 1000);
  visitor.real({"state/max_step", "m", "a larger jump of the estimate between two images voids earlier confirmations"},
               max_step_m, 0.1, 10000.0);
}

std::vector<std::string> StateConfig::violations() const {
  if (images_to_confirm <= window) return {};
  return {"parameter 'state/images_to_confirm' must not exceed 'state/window'"};
}

void StateAssessor::reset() { *this = StateAssessor(config_); }

LocalizationState StateAssessor::assess(const TrackerEstimate& estimate, FeatureKind features, bool recovering) {
  const bool jumped = last_position_m_ && (estimate.position_m - *last_position_m_).norm() > config_.max_step_m;
  last_position_m_ = estimate.position_m;
  if (jumped) confirmations_.clear();
  confirmations_.push_back(confirms(estimate, features));
  if (confirmations_.size() > static_cast<std::size_t>(config_.window)) confirmations_.pop_front();

  const auto confirmed = std::count(confirmations_.begin(), confirmations_.end(), true);
  const bool certain = confirmed >= config_.images_to_confirm;
  ever_confirmed_ = ever_confirmed_ || certain;
  if (recovering) return LocalizationState::kRecovering;
  if (certain) return LocalizationState::kTracking;
  return ever_confirmed_ ? LocalizationState::kUncertain : LocalizationState::kInitializing;
}

bool StateAssessor::confirms(const TrackerEstimate& estimate, FeatureKind features) const {
  if (estimate.best_distance_m > config_.max_distance_m) return false;
  if (features == FeatureKind::kGlobal) return estimate.best.similarity >= config_.min_global_similarity;
  return estimate.best.similarity >= config_.min_similarity &&
         estimate.best.matches >= static_cast<std::size_t>(config_.min_matches);
}

}  // namespace visual_localization
