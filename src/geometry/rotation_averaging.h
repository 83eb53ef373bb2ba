#pragma once

#include <cstdint>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace visual_localization {

/// How camera b is turned against camera a: turns directions in a's frame into those in b's.
struct RelativeRotation {
  std::uint32_t a = 0;
  std::uint32_t b = 0;
  Eigen::Quaterniond b_from_a = Eigen::Quaterniond::Identity();
};

/// What the directions of the cameras come to.
struct AveragedRotations {
  std::vector<Eigen::Quaterniond> camera_in_map;
  /// How the camera is mounted: turned against a level camera that looks along the direction of travel, as a rotation
  /// vector in its frame (x pitch, y yaw, z roll), radians.
  Eigen::Vector3d mounting_rad = Eigen::Vector3d::Zero();
};

/// Rotations of all cameras from relative rotations and the directions of travel (`travel_yaws_rad`, 0 = east,
/// counter-clockwise), of which both may be wrong here and there (Cauchy losses). The mounting is one for all cameras.
AveragedRotations averageRotations(const std::vector<double>& travel_yaws_rad,
                                   const std::vector<RelativeRotation>& relative);

}  // namespace visual_localization
