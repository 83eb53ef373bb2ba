#pragma once

#include <cmath>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "base/numbers.h"
#include "visual_localization/camera/camera_model.h"
#include "visual_localization/features/feature_matcher.h"
#include "visual_localization/features/local_features.h"

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

/// Standard deviation of the position of a small feature, of images of a map and of a live camera alike.
constexpr double kKeypointSigma_px = 0.3;

/// Where the features of an image are in the camera's frame, index by index.
struct KeypointRays {
  std::vector<Eigen::Vector2d> normalised;  ///< x/z, y/z; NaN where the lens has no ray
  std::vector<double> sigmas;               ///< standard deviation of each coordinate, same unit
  std::vector<Eigen::Vector2f> pixels;      ///< as recorded
  std::vector<float> sigmas_px;             ///< standard deviation of each coordinate
};

/// The same features by another calibration.
inline void setCamera(const CameraModel& camera, KeypointRays& rays) {
  std::vector<Eigen::Vector2d> pixels;
  for (const Eigen::Vector2f& pixel : rays.pixels) pixels.push_back(pixel.cast<double>());
  rays.normalised = camera.undistort(pixels);
  rays.sigmas.clear();
  for (const float sigma_px : rays.sigmas_px) {
    rays.sigmas.push_back(static_cast<double>(sigma_px) / camera.intrinsics().fx);
  }
}

/// A large feature, whose octave has larger pixels, is found less exactly than a small one.
inline KeypointRays raysOf(const LocalFeatures& features, const CameraModel& camera) {
  constexpr double kSmall_px = 6.0;
  KeypointRays rays;
  for (const Keypoint& keypoint : features.keypoints()) {
    const double growth = std::hypot(1.0, keypoint.size_px / kSmall_px);
    rays.pixels.emplace_back(keypoint.x_px, keypoint.y_px);
    rays.sigmas_px.push_back(static_cast<float>(kKeypointSigma_px * growth));
  }
  setCamera(camera, rays);
  return rays;
}

/// The matches of which both features have a ray.
inline std::vector<FeatureMatch> usable(const std::vector<FeatureMatch>& matches, const KeypointRays& a,
                                        const KeypointRays& b) {
  std::vector<FeatureMatch> kept;
  for (const FeatureMatch& match : matches) {
    if (a.normalised[match.a].allFinite() && b.normalised[match.b].allFinite()) kept.push_back(match);
  }
  return kept;
}

}  // namespace visual_localization
