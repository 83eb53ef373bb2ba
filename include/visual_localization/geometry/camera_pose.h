#pragma once

#include <cmath>

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace visual_localization {

/// Where a camera is and where it looks: its optical frame (x right, y down, z ahead) in the map frame (east, north,
/// up).
struct CameraPose {
  Eigen::Quaterniond rotation =
      Eigen::Quaterniond::Identity();                    ///< camera_in_map: from the camera's frame to the map's
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();  ///< of the optical centre, map frame

  Eigen::Vector3d toCamera(const Eigen::Vector3d& in_map_m) const {
    return rotation.conjugate() * (in_map_m - position_m);
  }
  Eigen::Vector3d ahead() const { return rotation * Eigen::Vector3d::UnitZ(); }
  /// Of the viewing direction: 0 = east, counter-clockwise.
  double yaw_rad() const {
    const Eigen::Vector3d view = ahead();
    return std::atan2(view.y(), view.x());
  }
};

/// Camera_in_map of a level camera that looks along `yaw_rad`.
inline Eigen::Quaterniond levelCamera(double yaw_rad) {
  Eigen::Matrix3d axes;  // columns: the camera's axes in the map
  axes.col(0) = Eigen::Vector3d(std::sin(yaw_rad), -std::cos(yaw_rad), 0.0);
  axes.col(1) = -Eigen::Vector3d::UnitZ();
  axes.col(2) = Eigen::Vector3d(std::cos(yaw_rad), std::sin(yaw_rad), 0.0);
  return Eigen::Quaterniond(axes);
}

/// Camera_in_map of a camera that looks along a road that climbs by `slope` (rise over run), and leans to no side.
inline Eigen::Quaterniond uprightCamera(double yaw_rad, double slope) {
  if (slope == 0.0) return levelCamera(yaw_rad);
  return levelCamera(yaw_rad) * Eigen::AngleAxisd(std::atan(slope), Eigen::Vector3d::UnitX());
}

}  // namespace visual_localization
