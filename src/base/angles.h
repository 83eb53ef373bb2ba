#pragma once

#include <cmath>

namespace visual_localization {

constexpr double kPi = 3.14159265358979323846;

/// The shorter way round from one angle to another, radians in [-pi, pi].
inline double angleDifference(double from_rad, double to_rad) { return std::remainder(to_rad - from_rad, 2.0 * kPi); }

/// Whether two images taken at the same position, that look these ways, can show the same.
inline bool faceAlike(double yaw_rad, double other_yaw_rad) {
  constexpr double kSameView_rad = 0.5 * kPi;
  return std::abs(angleDifference(yaw_rad, other_yaw_rad)) <= kSameView_rad;
}

}  // namespace visual_localization
