#pragma once

#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "geometry/bundle_adjustment.h"
#include "visual_localization/geometry/camera_pose.h"
#include "visual_localization/geometry/image_geometry.h"

namespace visual_localization {

/// Of a landmark's position (m2, map frame) among cameras that stand still.
Eigen::Matrix3d covarianceOf(const Landmark& landmark, const std::vector<CameraPose>& cameras);
/// Appends the landmark to an image that shows it; not one whose covariance is none.
void addSighting(const Landmark& landmark, const Eigen::Matrix3d& covariance, std::uint32_t feature, std::uint32_t id,
                 ImageGeometry& image);

}  // namespace visual_localization
