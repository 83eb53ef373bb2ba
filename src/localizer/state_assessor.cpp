#include "visual_localization/localizer/state_assessor.h"

namespace visual_localization {

void StateConfig::declare(ParameterVisitor& visitor) {
  visitor.integer({"state/min_matches", "1", "fewer matched SIFT features are no evidence, whatever their share"},
                  min_matches, 0, 10000);
  visitor.integer({"state/images_to_confirm", "1", "recognised images in a row before TRACKING"}, images_to_confirm, 1,
                  1000);
  visitor.integer({"state/images_to_doubt", "1", "unrecognised images in a row before UNCERTAIN"}, images_to_doubt, 1,
                  1000);
  visitor.real({"state/max_step", "m", "a larger jump of the estimate between two images breaks the row"}, max_step_m,
               0.1, 10000.0);
}

StateAssessor::StateAssessor(const StateConfig& config, double recognised_similarity)
    : config_(config), recognised_similarity_(recognised_similarity) {}

void StateAssessor::reset() { *this = StateAssessor(config_, recognised_similarity_); }

LocalizationState StateAssessor::assess(const TrackerEstimate& estimate, bool recovering) {
  const bool similar = estimate.best.similarity >= recognised_similarity_ &&
                       estimate.best.matches >= static_cast<std::size_t>(config_.min_matches);
  const bool steady = !has_last_ || (estimate.position_m - last_position_m_).norm() <= config_.max_step_m;
  has_last_ = true;
  last_position_m_ = estimate.position_m;

  recognised_ = !similar ? 0 : steady ? recognised_ + 1 : 1;
  unrecognised_ = similar && steady ? 0 : unrecognised_ + 1;
  if (recognised_ >= config_.images_to_confirm) confirmed_ = true;

  if (recovering) return LocalizationState::kRecovering;
  if (!confirmed_) return LocalizationState::kInitializing;
  const bool doubtful = unrecognised_ >= config_.images_to_doubt || !steady;
  return doubtful ? LocalizationState::kUncertain : LocalizationState::kTracking;
}

}  // namespace visual_localization
