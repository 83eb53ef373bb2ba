#pragma once

#include <cmath>

namespace visual_localization {

constexpr double kPi = 3.14159265358979323846;

/// The shorter way round from one angle to another, radians in [-pi, pi].
inline double angleDifference(double from_rad, double to_rad) { return std::remainder(to_rad - from_rad, 2.0 * kPi); }

}  // namespace visual_localization
