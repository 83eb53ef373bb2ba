#pragma once

#include <cmath>
#include <stdexcept>
#include <string>

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

/// A mount that is no rigid transform, or not one of a robot. The text is one line.
class MountError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Where a robot carries camera and antenna, in its own frame (REP 105 base_link: x ahead, y left, z up). Unless
/// somebody says otherwise both are in its origin, and the camera looks ahead.
struct SensorMount {
  CameraPose camera{levelCamera(0.0), Eigen::Vector3d::Zero()};  ///< of the optical frame
  Eigen::Vector3d antenna_m = Eigen::Vector3d::Zero();

  /// The antenna in the camera's optical frame.
  Eigen::Vector3d antennaInCamera_m() const { return camera.toCamera(antenna_m); }
  /// The robot's frame in the map, by the camera's pose there.
  Eigen::Isometry3d baseInMap(const CameraPose& camera_in_map) const;
};

/// Of the x axis: 0 = east, counter-clockwise.
double yawOf(const Eigen::Isometry3d& base_in_map);

/// Throws MountError unless everything is finite, rotations are of unit length and nothing is farther than 100 m from
/// the robot's origin.
void requireMount(const SensorMount& mount);

/// "x y z yaw pitch roll" (metres and radians, as for static_transform_publisher) of a camera (x ahead, y left, z up).
/// Throws MountError.
CameraPose parseCameraMount(const std::string& text);
/// "x y z", metres. Throws MountError.
Eigen::Vector3d parseAntennaMount(const std::string& text);

/// For people: "camera at 0.20 0.05 1.10 m, looking 15.0 degrees to the left and 0.0 up; antenna at ...".
std::string describe(const SensorMount& mount);

}  // namespace visual_localization
