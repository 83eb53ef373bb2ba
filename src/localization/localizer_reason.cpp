// Why the state of an image is what it is.

#include <algorithm>

#include "base/numbers.h"
#include "localization/place_filter.h"
#include "localization/pose_verifier.h"
#include "visual_localization/localization/localizer.h"

namespace visual_localization {

void Localizer::explainLast(const std::optional<PredictedPose>& predicted, bool is_late) {
  Estimate& estimate = *last_;
  estimate.unconfirmed = assessor_.unconfirmed();
  if (estimate.evidence.probability) {
    estimate.threshold = config_.state.min_probability;
    estimate.belief = posterior().beliefAround(estimate.pose.position_m, hereRadius_m(estimate.tracked.best_image));
  }
  if (estimate.state == LocalizationState::kTracking) left_at_.reset();
  if (estimate.belief.end) left_at_ = estimate.belief.end;
  Circumstances circumstances;
  circumstances.late = is_late;
  circumstances.turned = predicted && isTurned(*predicted);
  circumstances.doubtful = assessor_.isDoubtful();
  circumstances.unconfirmed = static_cast<std::size_t>(estimate.unconfirmed);
  circumstances.left_at = left_at_;
  estimate.why = explain(estimate, config_.state, circumstances);
}

/// Where the verified motion leads to, no training image looks into its direction.
bool Localizer::isTurned(const PredictedPose& predicted) {
  constexpr std::size_t kAsked = 10;
  const double around_m = posterior().around_m();
  map_->nearest(predicted.position_m, kAsked, neighbours_);
  if (neighbours_.front().distance_m > around_m) return false;
  return std::none_of(neighbours_.begin(), neighbours_.end(), [&](const Neighbour& one) {
    return one.distance_m <= around_m && faceAlike(map_->yaw_rad(one.image), predicted.yaw_rad);
  });
}

}  // namespace visual_localization
