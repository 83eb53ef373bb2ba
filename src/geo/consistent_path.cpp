#include "geo/consistent_path.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

#include "base/statistics.h"

namespace visual_localization {
namespace {

constexpr std::size_t kNone = static_cast<std::size_t>(-1);

/// Mean speeds over the shortest spans of at least `min_span_s`.
std::vector<double> spanSpeeds(const std::vector<PathSample>& samples, double min_span_s) {
  std::vector<double> speeds;
  std::size_t end = 0;
  for (std::size_t begin = 0; begin < samples.size(); ++begin) {
    while (end < samples.size() && samples[end].time_s - samples[begin].time_s < min_span_s) ++end;
    if (end == samples.size()) break;
    const double span_s = samples[end].time_s - samples[begin].time_s;
    if (span_s > 3.0 * min_span_s) continue;  // a gap says little about the speed
    speeds.push_back((samples[end].position_m - samples[begin].position_m).norm() / span_s);
  }
  return speeds;
}

/// Cost of going from one believed sample straight to another. A robot may stand still, and the straight line cuts
/// its corners; apart from that it neither races nor crawls.
double stepCost(const PathSample& from, const PathSample& to, const DrivingModel& motion) {
  constexpr double kStanding = 0.2;  // of the typical speed
  constexpr double kStandingCost = 0.5;
  constexpr double kMostForSlow = 4.0;
  const double duration_s = to.time_s - from.time_s;
  const double speed_mps = (to.position_m - from.position_m).norm() / duration_s;
  if (speed_mps < kStanding * motion.speed_mps) return kStandingCost;
  const double noise_mps = motion.step_noise_m / duration_s;
  const double sigmas = (speed_mps - motion.speed_mps) / std::hypot(noise_mps, motion.speed_std_mps);
  return sigmas > 0.0 ? sigmas * sigmas : std::min(kMostForSlow, sigmas * sigmas);
}

/// That of the fastest quarter; of a robot that was parked for more than three quarters of the recording, that of what
/// is clearly faster than its noise. `speeds_mps`: in order.
double speedOfMotion(const std::vector<double>& speeds_mps) {
  constexpr double kParked = 0.2;  // m/s
  constexpr double kClearly = 3.0;
  constexpr double kLeastShare = 0.02;  // less are spikes
  const double fast_mps = speeds_mps[speeds_mps.size() * 3 / 4];
  if (fast_mps >= kParked) return fast_mps;
  const auto moving = std::lower_bound(speeds_mps.begin(), speeds_mps.end(), std::max(kParked, kClearly * fast_mps));
  const auto count = speeds_mps.end() - moving;
  if (static_cast<double>(count) < kLeastShare * static_cast<double>(speeds_mps.size())) return fast_mps;
  return moving[count / 2];
}

}  // namespace

SpeedStatistics measureSpeed(const std::vector<PathSample>& samples, double min_span_s) {
  constexpr double kStanding = 0.25;  // of the fastest quarter's speed
  std::vector<double> speeds = spanSpeeds(samples, min_span_s);
  if (speeds.empty()) return {};
  std::sort(speeds.begin(), speeds.end());
  const double fast_mps = speedOfMotion(speeds);
  speeds.erase(speeds.begin(), std::lower_bound(speeds.begin(), speeds.end(), kStanding * fast_mps));
  const double median_mps = upperMedian(speeds);
  for (double& speed : speeds) speed = std::abs(speed - median_mps);
  return {median_mps, 1.4826 * upperMedian(speeds)};
}

std::vector<bool> consistentSamples(const std::vector<PathSample>& samples, const DrivingModel& motion) {
  const std::size_t count = samples.size();
  const auto costOfSkipping = [&motion](std::size_t skipped) {
    return skipped == 0 ? 0.0 : motion.opening_cost + motion.rejection_cost * static_cast<double>(skipped);
  };
  std::vector<double> cost(count);
  std::vector<std::size_t> previous(count, kNone);
  for (std::size_t j = 0; j < count; ++j) {
    cost[j] = costOfSkipping(j);  // everything before is left out
    for (std::size_t i = j; i-- > 0 && samples[j].time_s - samples[i].time_s <= motion.max_bridge_s;) {
      const double skipping = costOfSkipping(j - i - 1);
      if (skipping >= cost[j]) break;
      const double total = cost[i] + skipping + stepCost(samples[i], samples[j], motion);
      if (total >= cost[j]) continue;
      cost[j] = total;
      previous[j] = i;
    }
  }
  std::vector<bool> consistent(count, false);
  std::size_t last = kNone;
  double best = std::numeric_limits<double>::infinity();
  for (std::size_t j = 0; j < count; ++j) {
    const double total = cost[j] + costOfSkipping(count - 1 - j);
    if (total < best) {
      best = total;
      last = j;
    }
  }
  for (; last != kNone; last = previous[last]) consistent[last] = true;
  return consistent;
}

}  // namespace visual_localization
