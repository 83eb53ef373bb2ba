#pragma once

#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "visual_localization/geometry/camera_pose.h"

namespace visual_localization {

/// A landmark that an image of the map shows.
struct SeenLandmark {
  std::uint32_t feature = 0;  ///< index among the image's SIFT features
  std::uint32_t id = 0;       ///< the same in all images of the map that show it
  /// From the camera's optical centre, along the axes of the map (east, north, up): small numbers are exact as floats.
  Eigen::Vector3f offset_m = Eigen::Vector3f::Zero();
  float sigma_along_m = 0.0F;   ///< standard deviation along the ray from this camera, relative to this camera
  float sigma_across_m = 0.0F;  ///< the same across the ray, in either direction
};

/// What the adjustment found out about an image: its camera's pose and the landmarks that it shows.
struct ImageGeometry {
  CameraPose camera;
  /// Of the pose in the map frame: position (east, north, up; metres), then rotation about these axes (radians).
  Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Zero();
  std::vector<SeenLandmark> landmarks;  ///< in order of the feature, each feature at most once
};

}  // namespace visual_localization
