#pragma once

#include <cmath>

#include <Eigen/Core>
#include <Eigen/Geometry>

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

}  // namespace visual_localization
