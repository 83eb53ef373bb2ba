#pragma once

#include <cmath>
#include <vector>

#include <Eigen/Geometry>

#include "geometry/session_geometry.h"
#include "visual_localization/geo/trajectory.h"
#include "visual_localization/geometry/camera_pose.h"

namespace visual_localization {

/// How a road rises and falls under the images of a session.
struct PathHeights {
  std::vector<double> up_m;   ///< of each image, above that of the first one
  std::vector<double> slope;  ///< of each image, rise over run in the direction of travel
  double sigma_m = 0.0;       ///< median standard deviation of a fix's altitude
};

/// By the altitudes of the fixes near the cleaned path: a line through those within 20 m along the path, for each image
/// (least squares; roads are not steep). Nothing without altitudes, when all are the same (the receiver measures none),
/// or when there are images that none is near.
PathHeights pathHeights(const std::vector<TrajectoryPoint>& images, const std::vector<MapFix>& fixes);

/// Camera_in_map of a camera that looks along a road that climbs by `slope` (rise over run), and leans to no side.
inline Eigen::Quaterniond uprightCamera(double yaw_rad, double slope) {
  if (slope == 0.0) return levelCamera(yaw_rad);
  return levelCamera(yaw_rad) * Eigen::AngleAxisd(std::atan(slope), Eigen::Vector3d::UnitX());
}

}  // namespace visual_localization
