#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <ceres/autodiff_cost_function.h>
#include <ceres/rotation.h>

namespace visual_localization {

/// w, x, y, z as Ceres takes them.
inline Eigen::Vector4d ceresQuaternion(const Eigen::Quaterniond& q) { return {q.w(), q.x(), q.y(), q.z()}; }

/// How far a camera is turned away from where its mounting on the robot would have it. Parameters: the rotation vector
/// of the camera from `start` (camera_in_map = start * exp(w)), and that of the mounting.
class MountingResidual {
 public:
  /// `travel`: camera_in_map of an upright camera that looks along the direction of travel. `sigma_rad`: of pitch, yaw
  /// and roll.
  MountingResidual(const Eigen::Quaterniond& start, const Eigen::Quaterniond& travel, const Eigen::Vector3d& sigma_rad)
      : travel_from_start_(ceresQuaternion(travel.conjugate() * start)), sigma_rad_(sigma_rad) {}

  template <class T>
  bool operator()(const T* turn, const T* mounting, T* residual) const {
    const T back[3] = {-mounting[0], -mounting[1], -mounting[2]};
    T mounted[4];
    T turned[4];
    T travel_from_start[4];
    T difference[4];
    T product[4];
    for (int i = 0; i < 4; ++i) travel_from_start[i] = T(travel_from_start_[i]);
    ceres::AngleAxisToQuaternion(back, mounted);
    ceres::AngleAxisToQuaternion(turn, turned);
    ceres::QuaternionProduct(travel_from_start, turned, product);
    ceres::QuaternionProduct(mounted, product, difference);
    ceres::QuaternionToAngleAxis(difference, residual);
    for (int i = 0; i < 3; ++i) residual[i] /= T(sigma_rad_[i]);
    return true;
  }

 private:
  Eigen::Vector4d travel_from_start_;
  Eigen::Vector3d sigma_rad_;
};

}  // namespace visual_localization
