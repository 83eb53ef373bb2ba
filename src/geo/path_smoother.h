#pragma once

#include <cstddef>
#include <vector>

#include "geo/consistent_path.h"

namespace visual_localization {

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
