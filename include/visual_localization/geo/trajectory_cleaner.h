#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "visual_localization/geo/trajectory.h"
#include "visual_localization/parameters/parameters.h"

namespace visual_localization {

/// What became of one fix.
enum class FixVerdict {
  kKept,
  kNoFix,       ///< the receiver said so, or the coordinates are not finite or out of range
  kDisordered,  ///< stamp not after the one before
  kTooFast,     ///< less than kShortestInterval_s after the one that was used before
  kSpike,       ///< single outlier
  kMultipath,   ///< slow deviation from the smooth path although the receiver claims a fix: a reflected signal
};

std::string toString(FixVerdict verdict);

/// Fixes come at up to 50 Hz, and stamps waver. More say nothing more: they would be noise over hardly any time.
constexpr double kShortestInterval_s = 0.015;

/// What is known of the robot's motion and of its receiver. The speed itself is estimated from the fixes.
struct TrajectoryCleanerConfig {
  double node_length_m = 1.3;
  double speed_tolerance = 0.05;
  double opening_cost = 8.0;
  double rejection_cost = 1.5;
  double margin_m = 1.5;
  double smoothing_length_m = 1.5;
  double speed_stiffness = 0.1;
  double outlier_distance_m = 1.0;
  double max_bridge_s = 90.0;

  void declare(ParameterVisitor& visitor);
};

/// The cleaned path and what was done to get it.
struct CleanedTrajectory {
  Trajectory trajectory;
  std::vector<FixVerdict> verdicts;  ///< one per given fix, in the given order
  std::size_t gaps_closed = 0;       ///< stretches without believable fix that were bridged
  double longest_gap_s = 0.0;        ///< the longest of them
};

/// Turns raw DGPS fixes into the smooth path that a robot at nearly constant speed must have driven (Kronfeld et
/// al. (journal), section 6, where people did this by hand): drops invalid fixes, spikes and multipath,
/// closes gaps along the smoothest path between their ends, in linear time whatever the stamps. Throws
/// std::runtime_error, in one line, when fewer than two believable fixes remain.
CleanedTrajectory cleanTrajectory(const std::vector<Fix>& fixes, const LocalFrame& frame,
                                  const TrajectoryCleanerConfig& config);

}  // namespace visual_localization
