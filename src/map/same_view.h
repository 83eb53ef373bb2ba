#pragma once

#include <cmath>

#include "base/angles.h"

namespace visual_localization {

/// Whether two images of one place, that look these ways, can show the same.
inline bool faceAlike(double yaw_rad, double other_yaw_rad) {
  constexpr double kSameView_rad = 0.5 * kPi;
  return std::abs(angleDifference(yaw_rad, other_yaw_rad)) <= kSameView_rad;
}

}  // namespace visual_localization
