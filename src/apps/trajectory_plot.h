#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include "visual_localization/geo/geodetic_point.h"
#include "visual_localization/geo/trajectory_cleaner.h"

namespace visual_localization::apps {

/// The fixes of one round beside what was made of them.
struct PlottedRound {
  std::string name;
  std::vector<Fix> fixes;
  CleanedTrajectory cleaned;
  std::vector<Eigen::Vector2d> images_m;  ///< where the kept images were taken
};

/// An SVG picture with a panel for each round: kept fixes, dropped ones with shape and colour of the reason, the
/// cleaned path and the kept images; metres, scale and north. With several rounds also one that shows their paths
/// together.
std::string plotTrajectories(const std::vector<PlottedRound>& rounds, const LocalFrame& frame);

}  // namespace visual_localization::apps
