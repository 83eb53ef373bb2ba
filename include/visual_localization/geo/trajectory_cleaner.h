#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "visual_localization/geo/geodetic_point.h"
#include "visual_localization/geo/local_frame.h"
#include "visual_localization/geo/trajectory.h"
#include "visual_localization/parameters/parameter_visitor.h"

namespace visual_localization {

/// What became of one fix.
enum class FixVerdict {
  kKept,
  kNoFix,       ///< the receiver said so, or the coordinates are not finite or out of range
  kDisordered,  ///< stamp not after the one before
  kSpike,       ///< single outlier
  kBend,        ///< slow deviation from the smooth path although the receiver claims a fix (multipath)
};

std::string toString(FixVerdict verdict);

/// TODO(geo): parameters of the robust smoother; every field with unit, range and meaning.
struct TrajectoryCleanerConfig {
  void declare(ParameterVisitor& visitor);
  /// Constraints that span fields, in words; empty when valid.
  std::vector<std::string> violations() const;
};

/// The cleaned path and what was done to get it.
struct CleanedTrajectory {
  Trajectory trajectory;
  std::vector<FixVerdict> verdicts;  ///< one per given fix, in the given order
  std::size_t gaps_closed = 0;       ///< stretches without believable fix that were bridged
  double longest_gap_s = 0.0;
};

/// Turns raw DGPS fixes into the smooth path that a robot at known, nearly constant speed must have driven
/// (Kronfeld et al. (journal), section 6, done by hand there): drops invalid fixes, spikes and multipath
/// bends, closes gaps. Throws std::runtime_error, in one line, when fewer than two believable fixes remain.
CleanedTrajectory cleanTrajectory(const std::vector<Fix>& fixes, const LocalFrame& frame,
                                  const TrajectoryCleanerConfig& config);

}  // namespace visual_localization
