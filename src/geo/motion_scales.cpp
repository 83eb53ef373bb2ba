#include "geo/motion_scales.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <utility>

#include "base/numbers.h"

namespace visual_localization {
namespace {

constexpr double kDegreesOfFreedom = 4.0;
constexpr double kMostHalf = 12.5;  ///< of a squared innovation in sigmas: a clear outlier

/// What a filter finds at each node.
struct Innovations {
  std::vector<double> squared;    ///< in squared sigmas
  std::vector<double> log_scale;  ///< logarithm of the variance
};

struct Scales {
  double density = 1.0;
  double noise_m = 1.0;
};

/// Nodes of a recording, and those of them to learn from.
struct Evidence {
  const std::vector<PathSample>& nodes;
  const std::vector<bool>& believed;
  double usual_mps;
  const std::vector<bool>& steps;

  bool isStep(std::size_t i) const { return !steps.empty() && steps[i]; }
  bool uses(std::size_t i) const { return believed.empty() || believed[i]; }
};

/// Runs the filter. The -log likelihood is returned.
double filter(const Evidence& evidence, const Scales& scales, Innovations* found) {
  constexpr double kLongestStep_s = 90.0;  // behind a longer gap it starts anew
  const double noise_var = scales.noise_m * scales.noise_m;
  double cost = 0.0;
  ConstantVelocity state;
  double last_s = -std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < evidence.nodes.size(); ++i) {
    const PathSample& node = evidence.nodes[i];
    const bool begins = node.time_s - last_s > kLongestStep_s;
    ConstantVelocity next = state;
    if (begins) {
      next = ConstantVelocity::startAt(node.position_m, scales.noise_m, evidence.usual_mps);
    } else {
      next.predict(node.time_s - last_s, scales.density);
    }
    if (evidence.isStep(i)) next.stepTo(node.position_m, noise_var);
    const double variance = next.position_var + noise_var;
    const double squared = (node.position_m - next.position_m).squaredNorm() / variance;
    if (found != nullptr) {
      found->squared.push_back(squared);
      found->log_scale.push_back(std::log(variance));
    }
    if (!evidence.uses(i)) continue;
    if (!begins) {
      cost += std::log(variance) + studentCost(squared);
      next.update(node.position_m, noise_var / studentWeight(squared));
    }
    state = next;
    last_s = node.time_s;
  }
  return cost;
}

Scales mostLikely(const Evidence& evidence, double least_noise_m) {
  constexpr double kLeastNoise_m = 0.01;
  constexpr double kMostNoise_m = 60.0;
  constexpr double kLeastDensity = 1e-4;
  constexpr double kMostDensity = 300.0;
  Scales best;
  double least = std::numeric_limits<double>::infinity();
  const auto consider = [&](const Scales& scales) {
    const double cost = filter(evidence, scales, nullptr);
    if (!(cost < least)) return;
    least = cost;
    best = scales;
  };
  for (double density = kLeastDensity; density < kMostDensity; density *= 4.0) {
    for (double noise_m = kLeastNoise_m; noise_m < kMostNoise_m; noise_m *= 2.5) {
      consider({density, std::max(least_noise_m, noise_m)});
    }
  }
  for (const double finer : {2.0, 1.4}) {
    const Scales middle = best;
    for (const double density : {middle.density / finer, middle.density, middle.density * finer}) {
      for (const double factor : {1.0 / std::sqrt(finer), 1.0, std::sqrt(finer)}) {
        consider({density, std::max({kLeastNoise_m, least_noise_m, factor * middle.noise_m})});
      }
    }
  }
  return best;
}

/// Without the largest twentieth; none counts for more than a clear outlier.
double trimmedMean(std::vector<double> values) {
  constexpr double kKept = 0.95;
  if (values.empty()) return 0.0;
  std::sort(values.begin(), values.end());
  const auto count = std::max<std::size_t>(1, static_cast<std::size_t>(kKept * static_cast<double>(values.size())));
  double sum = 0.0;
  for (std::size_t i = 0; i < count; ++i) sum += std::min(kMostHalf, values[i]);
  return sum / static_cast<double>(count);
}

/// Of the nodes that move, or do not, half the squared innovations: 1 on average where the filter has them right.
std::vector<double> halvesOf(const Evidence& evidence, const Innovations& found, const std::vector<bool>& moving,
                             bool moves) {
  std::vector<double> halves;
  for (std::size_t i = 0; i < moving.size(); ++i) {
    if (moving[i] == moves && evidence.uses(i)) halves.push_back(0.5 * found.squared[i]);
  }
  return halves;
}

/// How much larger the innovations are than the filter has them, on average or in their tail: exact straights between
/// a few bends leave the average small.
double excessOf(std::vector<double> halves) {
  constexpr double kTail = 0.9;
  if (halves.empty()) return 0.0;
  const double tail = std::min(kMostHalf, nearestRank(halves, kTail) / -std::log(1.0 - kTail));
  return std::max(tail, trimmedMean(std::move(halves)));
}

/// The mean of the values within half a minute of each node.
std::vector<double> meansAround(const std::vector<PathSample>& nodes, const std::vector<double>& values) {
  constexpr double kReach_s = 30.0;
  std::vector<double> means;
  std::vector<double> sums{0.0};
  for (const double value : values) sums.push_back(sums.back() + value);
  std::size_t begin = 0;
  std::size_t end = 0;
  for (const PathSample& node : nodes) {
    while (nodes[begin].time_s < node.time_s - kReach_s) ++begin;
    while (end < nodes.size() && nodes[end].time_s <= node.time_s + kReach_s) ++end;
    means.push_back((sums[end] - sums[begin]) / static_cast<double>(end - begin));
  }
  return means;
}

/// At each node, over about kSpeedLag_s around it.
std::vector<double> speedsAt(const std::vector<PathSample>& nodes) {
  constexpr double kHalf_s = 0.5 * kSpeedLag_s;
  std::vector<double> speeds_mps;
  std::size_t begin = 0;
  std::size_t end = 0;
  for (const PathSample& node : nodes) {
    while (begin + 1 < nodes.size() && nodes[begin + 1].time_s <= node.time_s - kHalf_s) ++begin;
    while (end + 1 < nodes.size() && nodes[end].time_s < node.time_s + kHalf_s) ++end;
    const double elapsed_s = nodes[end].time_s - nodes[begin].time_s;
    const double way_m = (nodes[end].position_m - nodes[begin].position_m).norm();
    speeds_mps.push_back(elapsed_s > 0.0 ? way_m / elapsed_s : 0.0);
  }
  return speeds_mps;
}

/// That of the fastest quarter; of a robot that was parked for more than three quarters of the recording, that of what
/// is clearly faster than its noise.
double speedOfMotion(std::vector<double> speeds_mps) {
  constexpr double kParked_mps = 0.2;
  constexpr double kClearly = 3.0;
  constexpr double kLeastShare = 0.02;  // less are spikes
  std::sort(speeds_mps.begin(), speeds_mps.end());
  const double fast_mps = quantile(speeds_mps, 0.75);
  if (fast_mps >= kParked_mps) return fast_mps;
  const auto moving =
      std::lower_bound(speeds_mps.begin(), speeds_mps.end(), std::max(kParked_mps, kClearly * fast_mps));
  const auto count = speeds_mps.end() - moving;
  if (static_cast<double>(count) < kLeastShare * static_cast<double>(speeds_mps.size())) return fast_mps;
  return moving[count / 2];
}

/// Which nodes move, and their usual speed.
std::vector<bool> findMotion(const std::vector<PathSample>& nodes, double& usual_mps) {
  constexpr double kStanding = 0.25;  // of the speed of motion
  constexpr double kLeast_mps = 0.05;
  const std::vector<double> speeds_mps = speedsAt(nodes);
  const double fast_mps = speedOfMotion(speeds_mps);
  std::vector<bool> moving;
  std::vector<double> moving_mps;
  for (const double speed_mps : speeds_mps) {
    moving.push_back(speed_mps > kStanding * fast_mps);
    if (moving.back()) moving_mps.push_back(speed_mps);
  }
  usual_mps = std::max(kLeast_mps, median(std::move(moving_mps)));
  return moving;
}

}  // namespace

double studentCost(double squared) { return 0.5 * (kDegreesOfFreedom + 2.0) * std::log1p(squared / kDegreesOfFreedom); }

double studentWeight(double squared) {
  return std::min(1.0, (kDegreesOfFreedom + 2.0) / (kDegreesOfFreedom + squared));
}

MotionScales learnScales(const std::vector<PathSample>& nodes, const std::vector<bool>& believed, double least_density,
                         const std::vector<bool>& steps, double least_noise_m) {
  constexpr double kLeastMoving = 0.05;
  constexpr double kFits = 2.0;
  constexpr int kMostSteps = 8;
  constexpr double kLeastStanding = 0.3;  // a robot that stands will drive again
  MotionScales scales;
  const std::vector<bool> moving = findMotion(nodes, scales.usual_mps);
  const Evidence evidence{nodes, believed, scales.usual_mps, steps};
  Scales likely = mostLikely(evidence, least_noise_m);
  Innovations found;
  filter(evidence, likely, &found);
  for (int step = 0; step < kMostSteps; ++step) {
    const double excess = excessOf(halvesOf(evidence, found, moving, true));
    if (step > 0 && excess < kFits) break;
    likely.density *= std::max(1.0, excess);
    found = {};
    filter(evidence, likely, &found);
  }
  if (likely.density < least_density) {
    likely.density = least_density;
    found = {};
    filter(evidence, likely, &found);
  }
  scales.acceleration_density = likely.density;
  scales.noise_m = likely.noise_m;
  scales.log_variance = median(found.log_scale);
  const double for_moving = std::max(kLeastMoving, excessOf(halvesOf(evidence, found, moving, true)));
  const double for_standing = std::max(kLeastStanding, trimmedMean(halvesOf(evidence, found, moving, false)));
  std::vector<double> costs;
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    scales.tolerance.push_back(moving[i] ? for_moving : for_standing);
    costs.push_back(studentCost(found.squared[i] / scales.tolerance[i]));
  }
  scales.mean_cost = meansAround(nodes, costs);
  return scales;
}

}  // namespace visual_localization
