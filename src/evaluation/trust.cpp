#include "evaluation/trust.h"

#include <cmath>

namespace visual_localization {
namespace {

/// NaN without any.
double share(std::size_t part, std::size_t rest) {
  return static_cast<double>(part) / static_cast<double>(part + rest);
}

}  // namespace

void Trust::add(const StepRecord& step) {
  if (std::isnan(step.error_m) || step.state == LocalizationState::kNoMap) return;
  const bool right = static_cast<double>(step.error_m) < kRight_m;
  if (step.state == LocalizationState::kTracking) {
    ++(right ? tracking_right : tracking_wrong);
  } else {
    ++(right ? lost_wrong : lost_right);
  }
  if (step.state == LocalizationState::kOffMap) {
    ++(step.off_map ? off_map_right : off_map_wrong);
  } else if (step.off_map) {
    ++off_map_missed;
  }
}

Trust& Trust::operator+=(const Trust& other) {
  tracking_right += other.tracking_right;
  tracking_wrong += other.tracking_wrong;
  lost_right += other.lost_right;
  lost_wrong += other.lost_wrong;
  off_map_right += other.off_map_right;
  off_map_wrong += other.off_map_wrong;
  off_map_missed += other.off_map_missed;
  return *this;
}

double Trust::trackingShare() const { return share(tracking_right + tracking_wrong, lost_right + lost_wrong); }
double Trust::wrongTracking() const { return share(tracking_wrong, tracking_right); }
double Trust::lostPrecision() const { return share(lost_right, lost_wrong); }
double Trust::lostRecall() const { return share(lost_right, tracking_wrong); }
double Trust::offMapPrecision() const { return share(off_map_right, off_map_wrong); }
double Trust::offMapRecall() const { return share(off_map_right, off_map_missed); }

}  // namespace visual_localization
