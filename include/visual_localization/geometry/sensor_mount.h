#pragma once

#include <optional>
#include <stdexcept>
#include <string>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "visual_localization/geometry/camera_pose.h"

namespace visual_localization {

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
