#pragma once

#include <cstddef>
#include <vector>

#include <Eigen/Core>

namespace visual_localization {

/// A measured position of a path.
struct PathSample {
  double time_s = 0.0;                                   ///< since any fixed moment
  Eigen::Vector2d position_m = Eigen::Vector2d::Zero();  ///< east, north
};

/// How a vehicle moves and how well its samples are known.
struct DrivingModel {
  double speed_mps = 0.0;       ///< typical speed while moving
  double speed_std_mps = 0.0;   ///< how much that varies
  double step_noise_m = 0.0;    ///< std of the length of a step between two samples
  double opening_cost = 0.0;    ///< cost of starting to leave samples out, in squared sigmas
  double rejection_cost = 0.0;  ///< cost of each sample left out, in squared sigmas
  double max_bridge_s = 0.0;    ///< longest time between two samples that are believed
};

/// Typical speed of a path most of whose samples are right, and its spread; robust against outliers and against
/// standing still.
struct SpeedStatistics {
  double median_mps = 0.0;
  double std_mps = 0.0;
};

/// Measures speeds over spans of at least `min_span_s`. All zero when there is no such span.
SpeedStatistics measureSpeed(const std::vector<PathSample>& samples, double min_span_s);

/// Which samples a vehicle that moves like this can have visited one after the other: the subset with the least
/// cost, where a step faster than the model costs its squared excess and a sample left out costs a constant
/// (dynamic programming, like the most probable path of a hidden Markov model). A deviation by multipath has to be
/// driven faster than the path it leaves, going out and coming back, and so loses as a whole.
std::vector<bool> consistentSamples(const std::vector<PathSample>& samples, const DrivingModel& motion);

/// How a path is smoothed.
struct PathSmootherConfig {
  double smoothing_time_s = 1.0;    ///< details shorter than this are noise
  double outlier_distance_m = 1.0;  ///< residuals beyond this lose their influence
  double speed_mps = 0.0;           ///< typical speed of travel
  double speed_share = 0.0;         ///< how stiff the speed is, relative to the stiffness against turning
};

/// A path on an even grid of times.
struct SmoothedPath {
  double start_s = 0.0;
  double step_s = 1.0;
  std::vector<Eigen::Vector2d> positions_m;

  /// Linear interpolation; `time_s` is clamped to the grid.
  Eigen::Vector2d at(double time_s) const;
};

/// The cubic smoothing spline through `samples` (least squares residuals plus integrated squared acceleration) on
/// an even grid, with a redescending loss (Geman-McClure) by iteratively reweighted least squares. Between samples
/// far apart it is the path of least acceleration. `samples`: at least two, in strictly increasing order of time.
SmoothedPath smoothPath(const std::vector<PathSample>& samples, const PathSmootherConfig& config);

}  // namespace visual_localization
