#include "geo/receiver_steps.h"

#include <algorithm>
#include <cmath>

#include "base/numbers.h"
#include "geo/motion_scales.h"

namespace visual_localization {
namespace {

/// Fixes on either side of a step that tell it: those of most of a second, since a driver may stamp a few of them late.
std::size_t besideOf(const std::vector<PathSample>& samples) {
  constexpr double kLeast = 4.0;
  constexpr double kBeside_s = 0.8;
  return static_cast<std::size_t>(std::max(kLeast, std::round(kBeside_s / typicalInterval(samples))));
}

Eigen::Vector2d velocityBefore(const std::vector<PathSample>& samples, std::size_t i) {
  const double elapsed_s = samples[i].time_s - samples[i - 1].time_s;
  return (samples[i].position_m - samples[i - 1].position_m) / elapsed_s;
}

/// Median of the fixes around the one at `i`.
Eigen::Vector2d velocityAround(const std::vector<PathSample>& samples, std::size_t i, std::size_t beside) {
  std::vector<Eigen::Vector2d> velocities_mps;
  for (std::size_t k = i - beside + 1; k < i + beside; ++k) velocities_mps.push_back(velocityBefore(samples, k));
  return medianOf(velocities_mps);
}

/// Fixes before the one at `i` and from it on, as if a robot that keeps its velocity had stood there.
struct Sides {
  std::vector<Eigen::Vector2d> before_m;
  std::vector<Eigen::Vector2d> behind_m;
  Eigen::Vector2d velocity_mps = Eigen::Vector2d::Zero();

  /// What is left of it where stamps that are a little late from here on explain most.
  double apart_m() const {
    constexpr double kLate_s = 0.1;
    constexpr double kMost = 0.5;
    const Eigen::Vector2d apart_m = medianOf(behind_m) - medianOf(before_m);
    const double squared = std::max(velocity_mps.squaredNorm(), 1e-12);
    const double late_s = std::clamp(apart_m.dot(velocity_mps) / squared, -kLate_s, kLate_s);
    const double left_m = (apart_m - late_s * velocity_mps).norm();
    return left_m < kMost * apart_m.norm() ? left_m : apart_m.norm();
  }
};

Sides sidesOf(const std::vector<PathSample>& samples, std::size_t i, std::size_t beside) {
  Sides sides;
  sides.velocity_mps = velocityAround(samples, i, beside);
  for (std::size_t k = i - beside; k < i + beside; ++k) {
    std::vector<Eigen::Vector2d>& side_m = k < i ? sides.before_m : sides.behind_m;
    side_m.emplace_back(samples[k].position_m - (samples[k].time_s - samples[i].time_s) * sides.velocity_mps);
  }
  return sides;
}

/// Whether three quarters are nearer than `most_m` to their median: others are spikes.
bool agree(const std::vector<Eigen::Vector2d>& positions_m, double most_m) {
  const Eigen::Vector2d middle_m = medianOf(positions_m);
  return std::count_if(positions_m.begin(), positions_m.end(), [&](const Eigen::Vector2d& position_m) {
           return (position_m - middle_m).norm() >= most_m;
         }) <= static_cast<std::ptrdiff_t>(positions_m.size() / 4);
}

/// Medians see a step also from a fix or two beside it: the fix that is farthest from the one before.
std::size_t exactly(const std::vector<PathSample>& samples, std::size_t i, std::size_t beside) {
  const Eigen::Vector2d velocity_mps = velocityAround(samples, i, beside);
  const auto jump_m = [&](std::size_t k) {
    const double elapsed_s = samples[k].time_s - samples[k - 1].time_s;
    return (samples[k].position_m - samples[k - 1].position_m - elapsed_s * velocity_mps).norm();
  };
  std::size_t best = i;
  for (std::size_t k = i - beside / 2; k <= i + beside / 2 && k < samples.size(); ++k) {
    if (jump_m(k) > jump_m(best)) best = k;
  }
  return best;
}

/// Values from `reach` before the one at `i` to as many behind it.
std::vector<double> around(const std::vector<double>& values, std::size_t i, std::size_t reach) {
  const std::size_t begin = i - std::min(i, reach);
  const std::size_t end = std::min(i + reach + 1, values.size());
  return {values.begin() + static_cast<std::ptrdiff_t>(begin), values.begin() + static_cast<std::ptrdiff_t>(end)};
}

}  // namespace

std::vector<std::size_t> stepsIn(const UsableFixes& usable) {
  constexpr double kLongest_s = 1.0;              // of those on one side: a robot turns and brakes in longer ones
  constexpr double kMost = 8.0 / kMedianOfPlane;  // of the usual median: eight sigmas
  constexpr double kMost_mps2 = 10.0;             // of a robot
  constexpr std::size_t kAround = 50;
  const std::vector<PathSample>& samples = usable.samples;
  if (samples.size() < 2) return {};
  const std::size_t beside = besideOf(samples);
  std::vector<double> aside_m(samples.size(), 0.0);
  for (std::size_t i = beside; i + beside <= samples.size(); ++i) {
    const bool is_fast = samples[i].time_s - samples[i - beside].time_s <= kLongest_s &&
                         samples[i + beside - 1].time_s - samples[i - 1].time_s <= kLongest_s;
    if (is_fast) aside_m[i] = sidesOf(samples, i, beside).apart_m();
  }
  std::vector<std::size_t> steps;
  const double usual_m = std::max(median(aside_m), kMedianOfPlane * usable.rounding_m);
  for (std::size_t i = beside; i + beside <= samples.size(); ++i) {
    const double promised_m = usable.sigmas_m[i];
    const double half_s = 0.25 * (samples[i + beside - 1].time_s - samples[i - beside].time_s);
    const double driven_m = 0.5 * kMost_mps2 * half_s * half_s;
    if (aside_m[i] <= std::max({promised_m, driven_m, kMost * usual_m})) continue;
    const std::vector<double> beside_m = around(aside_m, i, beside);
    if (*std::max_element(beside_m.begin(), beside_m.end()) > aside_m[i]) continue;
    if (aside_m[i] <= kMost * median(around(aside_m, i, kAround))) continue;
    const Sides sides = sidesOf(samples, i, beside);
    if (!agree(sides.before_m, 0.5 * aside_m[i]) || !agree(sides.behind_m, 0.5 * aside_m[i])) continue;
    const std::size_t step = exactly(samples, i, beside);
    if (steps.empty() || step > steps.back()) steps.push_back(step);
  }
  return steps;
}

}  // namespace visual_localization
