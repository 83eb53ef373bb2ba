#pragma once

#include <cmath>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "base/statistics.h"

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

}  // namespace visual_localization
