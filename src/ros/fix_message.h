#pragma once

#include <cstdint>

#include <sensor_msgs/NavSatFix.h>

#include "visual_localization/geo/geodetic_point.h"

namespace visual_localization {

/// A fix with the stamp given; what the receiver cannot know, or claims without sense, is 0.
Fix toFix(const sensor_msgs::NavSatFix& message, std::int64_t stamp_ns);

}  // namespace visual_localization
