#pragma once

#include <cmath>
#include <optional>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "base/numbers.h"
#include "visual_localization/camera/camera_model.h"
#include "visual_localization/features/sift_features.h"
#include "visual_localization/features/sift_matcher.h"
#include "visual_localization/geometry/camera_pose.h"

namespace visual_localization {

/// The matrix that multiplies like the cross product with `v`.
inline Eigen::Matrix3d crossMatrix(const Eigen::Vector3d& v) {
  Eigen::Matrix3d matrix;
  matrix << 0.0, -v.z(), v.y(), v.z(), 0.0, -v.x(), -v.y(), v.x(), 0.0;
  return matrix;
}

/// The rotation about `w` by its length, radians.
inline Eigen::Matrix3d exponential(const Eigen::Vector3d& w) {
  const double angle = w.norm();
  if (angle < 1e-12) return Eigen::Matrix3d::Identity() + crossMatrix(w);
  return Eigen::AngleAxisd(angle, w / angle).toRotationMatrix();
}

/// Right Jacobian of the rotation group: exp(w + dw) = exp(w) exp(J dw) to first order.
inline Eigen::Matrix3d rightJacobian(const Eigen::Vector3d& w) {
  const double angle = w.norm();
  const Eigen::Matrix3d cross = crossMatrix(w);
  if (angle < 1e-5) return Eigen::Matrix3d::Identity() - 0.5 * cross;
  return Eigen::Matrix3d::Identity() - (1.0 - std::cos(angle)) / (angle * angle) * cross +
         (angle - std::sin(angle)) / (angle * angle * angle) * cross * cross;
}

/// The median of each component; zero of none.
inline Eigen::Vector3d medianOf(const std::vector<Eigen::Vector3d>& vectors) {
  Eigen::Vector3d middle;
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> components;
    for (const Eigen::Vector3d& vector : vectors) components.push_back(vector[axis]);
    middle[axis] = median(components);
  }
  return middle;
}

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
