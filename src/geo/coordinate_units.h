#pragma once

#include <string>
#include <vector>

#include "visual_localization/geo/trajectory.h"

namespace visual_localization {

/// Fixes in units that some drivers use instead of degrees, made degrees: 1e-7 degrees, radians, longitudes from 0 to
/// 360, latitude and longitude exchanged where only that is on the earth. Likewise fixes whose driver never says that
/// there is a fix, though all have positions. Only what holds for all of them is changed. Returns a line for each.
std::vector<std::string> repairUnits(std::vector<Fix>& fixes);

}  // namespace visual_localization
