#include "geo/path_smoother.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <stdexcept>

#include <Eigen/Sparse>
#include <Eigen/SparseCholesky>

#include "base/numbers.h"

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

namespace {

using SparseMatrix = Eigen::SparseMatrix<double>;
/// Of a symmetric matrix: its lower triangle.
using Triplets = std::vector<Eigen::Triplet<double>>;

/// Where a time lies between two points of the grid.
struct GridPosition {
  Eigen::Index left = 0;
  double share = 0.0;  ///< of the way to the next point
};

GridPosition locate(const SmoothedPath& grid, double time_s) {
  const double steps = (time_s - grid.start_s) / grid.step_s;
  const double last = static_cast<double>(grid.positions_m.size()) - 2.0;
  const double left = std::clamp(std::floor(steps), 0.0, last);
  return {static_cast<Eigen::Index>(left), std::clamp(steps - left, 0.0, 1.0)};
}

SmoothedPath gridOver(const std::vector<PathSample>& samples, double smoothing_time_s) {
  constexpr double kStepsPerSmoothingTime = 3.0;
  constexpr double kMostPoints = 1e6;
  constexpr double kMostPointsPerSample = 100.0;  // a path between two samples has no more details
  const double duration_s = samples.back().time_s - samples.front().time_s;
  SmoothedPath grid;
  grid.start_s = samples.front().time_s;
  const double most_points = std::min(kMostPoints, kMostPointsPerSample * static_cast<double>(samples.size()));
  const double wanted_s = std::max(smoothing_time_s / kStepsPerSmoothingTime, duration_s / most_points);
  const double steps = std::max(2.0, std::ceil(duration_s / wanted_s));
  grid.step_s = duration_s / steps;
  grid.positions_m.resize(static_cast<std::size_t>(steps) + 1);
  return grid;
}

double medianInterval(const std::vector<PathSample>& samples) {
  std::vector<double> intervals;
  for (std::size_t i = 1; i < samples.size(); ++i) intervals.push_back(samples[i].time_s - samples[i - 1].time_s);
  return upperMedian(intervals);
}

/// Integrated squared acceleration, in units of one sample's residual: its weight is the fourth power of the
/// smoothing time over the interval between samples.
void addStiffness(const SmoothedPath& grid, double weight, Triplets& matrix) {
  const double scale = weight / (grid.step_s * grid.step_s * grid.step_s);
  const std::array<double, 3> difference{1.0, -2.0, 1.0};
  const auto points = static_cast<Eigen::Index>(grid.positions_m.size());
  for (Eigen::Index k = 0; k + 2 < points; ++k) {
    for (Eigen::Index i = 0; i < 3; ++i) {
      for (Eigen::Index j = 0; j <= i; ++j) {
        const double product = difference[static_cast<std::size_t>(i)] * difference[static_cast<std::size_t>(j)];
        matrix.emplace_back(k + i, k + j, scale * product);
      }
    }
  }
}

/// Pulls every step of the path towards the typical speed, in its present direction: the length of what was driven
/// through a gap is known even if its path is not. Steps much slower than that belong to a robot that stood.
void addSpeed(const SmoothedPath& path, double speed_mps, double weight, Triplets& matrix,
              Eigen::MatrixX2d& right_side) {
  constexpr double kMoving = 0.5;
  const double scale = weight / path.step_s;
  for (Eigen::Index k = 0; k + 1 < right_side.rows(); ++k) {
    const auto i = static_cast<std::size_t>(k);
    const Eigen::Vector2d step = path.positions_m[i + 1] - path.positions_m[i];
    if (step.norm() < kMoving * speed_mps * path.step_s) continue;
    const Eigen::RowVector2d wanted = scale * speed_mps * path.step_s * step.normalized().transpose();
    matrix.emplace_back(k, k, scale);
    matrix.emplace_back(k + 1, k + 1, scale);
    matrix.emplace_back(k + 1, k, -scale);
    right_side.row(k) -= wanted;
    right_side.row(k + 1) += wanted;
  }
}

void addSample(const GridPosition& where, const Eigen::Vector2d& position_m, double weight, Triplets& matrix,
               Eigen::MatrixX2d& right_side) {
  const std::array<double, 2> shares{1.0 - where.share, where.share};
  for (Eigen::Index i = 0; i < 2; ++i) {
    const double share_i = shares[static_cast<std::size_t>(i)];
    right_side.row(where.left + i) += weight * share_i * position_m.transpose();
    for (Eigen::Index j = 0; j <= i; ++j) {
      matrix.emplace_back(where.left + i, where.left + j, weight * share_i * shares[static_cast<std::size_t>(j)]);
    }
  }
}

/// One iteration of reweighted least squares.
void solve(const std::vector<PathSample>& samples, const std::vector<double>& weights, double stiffness,
           double speed_mps, double speed_weight, SmoothedPath& grid) {
  const auto points = static_cast<Eigen::Index>(grid.positions_m.size());
  Triplets triplets;
  triplets.reserve(grid.positions_m.size() * 9 + samples.size() * 3);
  Eigen::MatrixX2d right_side = Eigen::MatrixX2d::Zero(points, 2);
  addStiffness(grid, stiffness, triplets);
  if (speed_weight > 0.0) addSpeed(grid, speed_mps, speed_weight, triplets, right_side);
  for (std::size_t i = 0; i < samples.size(); ++i) {
    addSample(locate(grid, samples[i].time_s), samples[i].position_m, weights[i], triplets, right_side);
  }
  SparseMatrix matrix(points, points);
  matrix.setFromTriplets(triplets.begin(), triplets.end());
  const Eigen::SimplicialLDLT<SparseMatrix> solver(matrix);
  const Eigen::MatrixX2d solution = solver.solve(right_side);
  if (solver.info() != Eigen::Success || !solution.allFinite()) {
    throw std::runtime_error("the fixes do not determine a path");
  }
  for (Eigen::Index k = 0; k < points; ++k) grid.positions_m[static_cast<std::size_t>(k)] = solution.row(k);
}

/// Geman-McClure: quadratic near zero, without influence far out.
double weightOf(double residual_m, double outlier_distance_m) {
  constexpr double kLeast = 1e-4;  // keeps the system solvable
  const double ratio = residual_m / outlier_distance_m;
  const double root = 1.0 / (1.0 + ratio * ratio);
  return std::max(kLeast, root * root);
}

}  // namespace

Eigen::Vector2d SmoothedPath::at(double time_s) const {
  const GridPosition where = locate(*this, time_s);
  const auto left = static_cast<std::size_t>(where.left);
  return (1.0 - where.share) * positions_m[left] + where.share * positions_m[left + 1];
}

SmoothedPath smoothPath(const std::vector<PathSample>& samples, const PathSmootherConfig& config) {
  constexpr int kIterations = 30;
  if (samples.size() < 2) throw std::invalid_argument("a path needs at least two samples");
  SmoothedPath path = gridOver(samples, config.smoothing_time_s);
  const double stiffness = std::pow(config.smoothing_time_s, 4) / medianInterval(samples);
  std::vector<double> weights(samples.size(), 1.0);
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    const double speed_weight =
        iteration == 0 ? 0.0 : config.speed_share * stiffness / std::pow(config.smoothing_time_s, 2);
    solve(samples, weights, stiffness, config.speed_mps, speed_weight, path);
    for (std::size_t i = 0; i < samples.size(); ++i) {
      const double residual_m = (path.at(samples[i].time_s) - samples[i].position_m).norm();
      weights[i] = weightOf(residual_m, config.outlier_distance_m);
    }
  }
  return path;
}

}  // namespace visual_localization
