#include "evaluation/metrics.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numeric>
#include <stdexcept>
#include <string>

#include "base/statistics.h"

namespace visual_localization {
namespace {

/// NaN without any.
double share(std::size_t part, std::size_t rest) {
  return static_cast<double>(part) / static_cast<double>(part + rest);
}

}  // namespace

ErrorStatistics summarise(std::vector<double> errors_m) {
  ErrorStatistics statistics;
  if (errors_m.empty()) return statistics;
  const auto count = static_cast<double>(errors_m.size());
  std::sort(errors_m.begin(), errors_m.end());
  statistics.count = errors_m.size();
  statistics.mean_m = std::accumulate(errors_m.begin(), errors_m.end(), 0.0) / count;
  statistics.median_m = median(errors_m);
  const auto near = std::lower_bound(errors_m.begin(), errors_m.end(), kRight_m) - errors_m.begin();
  statistics.within_5m = static_cast<double>(near) / count;
  return statistics;
}

double recallAtPrecision(std::vector<Decision> decisions, double precision) {
  if (!(precision >= 0.0 && precision <= 1.0)) {
    throw std::invalid_argument("precision " + std::to_string(precision) + " is not in [0, 1]");
  }
  const auto unsure = [](const Decision& decision) { return std::isnan(decision.confidence); };
  if (std::any_of(decisions.begin(), decisions.end(), unsure)) throw std::invalid_argument("a confidence is NaN");
  std::sort(decisions.begin(), decisions.end(),
            [](const Decision& a, const Decision& b) { return a.confidence > b.confidence; });
  const std::size_t all = decisions.size();
  std::size_t correct = 0;
  std::size_t recalled = 0;
  for (std::size_t accepted = 1; accepted <= all; ++accepted) {
    correct += decisions[accepted - 1].correct ? 1 : 0;
    const bool tied = accepted < all && decisions[accepted].confidence == decisions[accepted - 1].confidence;
    if (!tied && static_cast<double>(correct) / static_cast<double>(accepted) >= precision) recalled = correct;
  }
  return all == 0 ? 0.0 : static_cast<double>(recalled) / static_cast<double>(all);
}

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
