#include "evaluation/pose_figures.h"

#include <cmath>

namespace visual_localization {
namespace {

constexpr double kInside95 = 5.991464547107979;  // chi squared with two degrees of freedom

/// NaN without any.
template <class Sum>
double mean(Sum sum, std::size_t count) {
  return static_cast<double>(sum) / static_cast<double>(count);
}

}  // namespace

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
