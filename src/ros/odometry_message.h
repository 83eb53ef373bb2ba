#pragma once

#include <cstdint>
#include <string>

#include <nav_msgs/Odometry.h>

#include "visual_localization/localization/odometry.h"

namespace visual_localization {

/// Position and heading of `base_frame` in the plane of the odometry's frame. Throws std::invalid_argument, in words,
/// when a number is not finite, the orientation is no rotation, it is about another frame of the robot, or its own
/// frame is `map_frame`: then it is no odometry, but what somebody has localised.
OdometryReading toReading(const nav_msgs::Odometry& message, std::int64_t stamp_ns, const std::string& base_frame,
                          const std::string& map_frame);

}  // namespace visual_localization
