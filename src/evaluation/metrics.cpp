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

constexpr double kInside95 = 5.991464547107979;  // chi squared with two degrees of freedom

/// NaN without any.
template <class Sum>
double mean(Sum sum, std::size_t count) {
  return static_cast<double>(sum) / static_cast<double>(count);
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

void PoseErrors::add(const StepErrors& errors) {
  const auto position = static_cast<double>(errors.position_m);
  if (std::isnan(position)) return;
  ++positions;
  position_m += position;
  if (!std::isnan(errors.nees)) {
    ++claims;
    inside_95 += static_cast<double>(errors.nees) <= kInside95 ? 1 : 0;
    nees += static_cast<double>(errors.nees);
  }
  const auto heading = static_cast<double>(errors.heading_deg);
  if (std::isnan(heading)) return;
  ++headings;
  heading_deg += heading;
  for (std::size_t i = 0; i < kRecall.size(); ++i) {
    recalled[i] += position <= kRecall[i].position_m && heading <= kRecall[i].heading_deg ? 1 : 0;
  }
}

PoseErrors& PoseErrors::operator+=(const PoseErrors& other) {
  positions += other.positions;
  position_m += other.position_m;
  headings += other.headings;
  heading_deg += other.heading_deg;
  for (std::size_t i = 0; i < recalled.size(); ++i) recalled[i] += other.recalled[i];
  claims += other.claims;
  inside_95 += other.inside_95;
  nees += other.nees;
  return *this;
}

double PoseErrors::meanPosition_m() const { return mean(position_m, positions); }
double PoseErrors::meanHeading_deg() const { return mean(heading_deg, headings); }
double PoseErrors::recall(std::size_t threshold) const { return mean(recalled.at(threshold), headings); }
double PoseErrors::insideShare() const { return mean(inside_95, claims); }
double PoseErrors::meanNees() const { return mean(nees, claims); }

void PoseFigures::add(const StepRecord& step) {
  absolute.add({step.error_m, step.heading_err_deg, step.nees});
  relative.add(step.relative);
  filtered.add(step.filtered);
  relative_filtered.add(step.relative_filtered);
  if (std::isnan(step.error_m) || step.state == LocalizationState::kNoMap) return;
  ++images;
  metric += step.source == PoseSource::kMetric ? 1 : 0;
  if (step.state != LocalizationState::kTracking) return;
  wrong_1m += step.error_m > 1.0F ? 1 : 0;
  wrong_5m += step.error_m > 5.0F ? 1 : 0;
}

PoseFigures& PoseFigures::operator+=(const PoseFigures& other) {
  images += other.images;
  metric += other.metric;
  wrong_1m += other.wrong_1m;
  wrong_5m += other.wrong_5m;
  absolute += other.absolute;
  relative += other.relative;
  filtered += other.filtered;
  relative_filtered += other.relative_filtered;
  return *this;
}

double PoseFigures::metricShare() const { return mean(metric, images); }
double PoseFigures::wrong1mShare() const { return mean(wrong_1m, images); }
double PoseFigures::wrong5mShare() const { return mean(wrong_5m, images); }

}  // namespace visual_localization
