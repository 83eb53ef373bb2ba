#pragma once

#include <vector>

#include "visual_localization/geo/trajectory_cleaner.h"

namespace visual_localization {

/// The same as cleanTrajectory for a recording that pauses: what lies between two pauses of more than
/// `config.max_bridge_s` is cleaned by itself, since nothing tells how the robot came from one to the other. A part
/// that is no path is left out, unless none is: then throws its std::runtime_error.
CleanedTrajectory cleanInParts(const std::vector<Fix>& fixes, const LocalFrame& frame,
                               const TrajectoryCleanerConfig& config);

}  // namespace visual_localization
