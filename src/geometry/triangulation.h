#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>

#include "visual_localization/geometry/camera_pose.h"

namespace visual_localization {

/// A ray from a camera towards a point.
struct Sight {
  const CameraPose* camera = nullptr;
  Eigen::Vector2d normalised = Eigen::Vector2d::Zero();  ///< x/z, y/z in the camera's frame
};

/// The point nearest to all rays (least squares), map frame, metres. Nothing when the rays are all but parallel, the
/// widest angle between two of them below `min_angle_rad`, or when the point is behind a camera.
std::optional<Eigen::Vector3d> triangulate(const std::vector<Sight>& sights, double min_angle_rad);

}  // namespace visual_localization
