#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include <Eigen/Core>

#include "evaluation/run.h"
#include "evaluation/velocity_filter.h"

namespace visual_localization {

/// Writes into `step` how far heading and claims of an estimate are from the truth (map frame), and what of that is not
/// the map's own error. `map_error`: none when it is not known.
void judgePose(const Estimate& estimate, const Eigen::Vector2d& truth_m, const std::optional<double>& true_yaw_rad,
               const std::optional<MapError>& map_error, StepRecord& step);

/// What the filter makes of a METRIC pose while TRACKING; of other estimates nothing.
void judgeFiltered(const Estimate& estimate, const Eigen::Vector2d& truth_m, const std::optional<MapError>& map_error,
                   VelocityFilter& filter, StepRecord& step);

/// One step as a line of a TUM trajectory: "stamp tx ty tz qx qy qz qw", x ahead, y left, z up in the map frame. Level
/// and at height 0 but for poses solved from landmarks.
std::string tumLine(const Estimate& estimate);
/// The same of a true pose. A heading that is not known is 0.
std::string tumLine(std::int64_t stamp_ns, const Eigen::Vector2d& position_m, double yaw_rad);

}  // namespace visual_localization
