#include "geo/path_smoother.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

#include <Eigen/Sparse>
#include <Eigen/SparseCholesky>

#include "base/statistics.h"

namespace visual_localization {
namespace {

using SparseMatrix = Eigen::SparseMatrix<double>;
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
      for (Eigen::Index j = 0; j < 3; ++j) {
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
    matrix.emplace_back(k, k + 1, -scale);
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
    for (Eigen::Index j = 0; j < 2; ++j) {
      matrix.emplace_back(where.left + i, where.left + j, weight * share_i * shares[static_cast<std::size_t>(j)]);
    }
  }
}

/// One iteration of reweighted least squares.
void solve(const std::vector<PathSample>& samples, const std::vector<double>& weights, double stiffness,
           double speed_mps, double speed_weight, SmoothedPath& grid) {
  const auto points = static_cast<Eigen::Index>(grid.positions_m.size());
  Triplets triplets;
  triplets.reserve(grid.positions_m.size() * 9 + samples.size() * 4);
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
