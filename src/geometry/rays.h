#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>

#include "visual_localization/camera/camera_model.h"
#include "visual_localization/features/sift_features.h"
#include "visual_localization/features/sift_matcher.h"
#include "visual_localization/geometry/camera_pose.h"

namespace visual_localization {

/// Where the features of an image are in the camera's frame, index by index.
struct KeypointRays {
  std::vector<Eigen::Vector2d> normalised;  ///< x/z, y/z; NaN where the lens has no ray
  std::vector<double> sigmas;               ///< standard deviation of each coordinate, same unit
};

/// A small feature is found to `sigma_px`, a large one, whose octave has larger pixels, less exactly.
KeypointRays raysOf(const SiftFeatures& features, const CameraModel& camera, double sigma_px);

/// The matches of which both features have a ray.
std::vector<FeatureMatch> usable(const std::vector<FeatureMatch>& matches, const KeypointRays& a,
                                 const KeypointRays& b);

/// A ray from a camera towards a point.
struct Sight {
  const CameraPose* camera = nullptr;
  Eigen::Vector2d normalised = Eigen::Vector2d::Zero();  ///< x/z, y/z in the camera's frame
};

/// The point nearest to all rays (least squares), map frame, metres. Nothing when the rays are all but parallel, the
/// widest angle between two of them below `min_angle_rad`, or when the point is behind a camera.
std::optional<Eigen::Vector3d> triangulate(const std::vector<Sight>& sights, double min_angle_rad);

}  // namespace visual_localization
