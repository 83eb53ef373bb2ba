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
  kDisordered,  ///< stamp not after the one before, or far ahead of those behind
  kTooFast,     ///< less than kShortestInterval_s after the one that was used before
  kRepeated,    ///< the one before once more, by a driver that is faster than its receiver
  kSpike,       ///< single outlier, or farther from the map's datum than a tangent plane reaches
  kMultipath,   ///< deviation for a while although the receiver claims a fix: a reflected signal
};

std::string toString(FixVerdict verdict);

/// Fixes come at up to 50 Hz, and stamps waver. More say nothing more: they would be noise over hardly any time.
constexpr double kShortestInterval_s = 0.015;

/// What is known of the robot's motion beforehand. How it moves and how its receiver errs is learnt from the fixes.
struct TrajectoryCleanerConfig {
  double speed_tolerance = 0.0;
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

/// Turns raw fixes into the most probable path of the robot (Kronfeld et al. (journal), section 6, where people did
/// this by hand): drops invalid fixes, spikes and what can only be multipath, sees through steps of the receiver's
/// error, and closes gaps. How the robot moves and how the receiver errs is learnt from the recording; a robot whose
/// speed turns out constant, as the papers', is held to it. What is uncertain is believed: the adjustment by images
/// decides later. In nearly linear time whatever the stamps. Throws std::runtime_error, in one line, when fewer than
/// two believable fixes remain.
CleanedTrajectory cleanTrajectory(const std::vector<Fix>& fixes, const LocalFrame& frame,
                                  const TrajectoryCleanerConfig& config);

}  // namespace visual_localization
