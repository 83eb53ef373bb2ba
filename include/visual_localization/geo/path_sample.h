#pragma once

#include <Eigen/Core>

namespace visual_localization {

/// A measured position of a path.
struct PathSample {
  double time_s = 0.0;                                   ///< since any fixed moment
  Eigen::Vector2d position_m = Eigen::Vector2d::Zero();  ///< east, north
};

}  // namespace visual_localization
