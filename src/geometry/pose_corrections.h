#pragma once

#include <cstddef>
#include <utility>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "visual_localization/geometry/camera_pose.h"

namespace visual_localization {

/// How a camera of a map moves: a turn about itself, then a shift.
struct PoseCorrection {
  Eigen::Quaterniond turn = Eigen::Quaterniond::Identity();  ///< about the map's axes
  Eigen::Vector3d shift_m = Eigen::Vector3d::Zero();         ///< east, north, up

  bool isNone() const { return shift_m.isZero(0.0) && turn.vec().isZero(0.0); }
  CameraPose of(const CameraPose& camera) const {
    return {(turn * camera.rotation).normalized(), camera.position_m + shift_m};
  }
  /// The same of a pose that keeps its place beside a camera at `about_m`, which moves like this.
  CameraPose of(const CameraPose& pose, const Eigen::Vector3d& about_m) const {
    return {(turn * pose.rotation).normalized(), about_m + turn * (pose.position_m - about_m) + shift_m};
  }
  /// This one first.
  PoseCorrection then(const PoseCorrection& other) const {
    return {(other.turn * turn).normalized(), shift_m + other.shift_m};
  }
};

/// Where a camera is by the landmarks of another map.
struct PoseTie {
  std::size_t camera = 0;
  CameraPose pose;
  /// Position (metres), then rotation (radians), about the map's axes.
  Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Identity();
};

/// How poses of a map err: alike where they are close, each its own way where they are far apart (a Gauss-Markov
/// process along the path, as the errors of a receiver are).
struct CorrectionModel {
  double sigma_m = 0.5;     ///< of each axis of the position
  double sigma_rad = 0.01;  ///< of each axis of the rotation
  double length_m = 50.0;   ///< after which errors have little to do with each other
};

/// The most likely corrections of `cameras` (those of a session follow each other) by their ties, least squares with a
/// Cauchy loss. What `neighbours`, pairs of cameras, have seen of each other stays. Heights are moved by the median of
/// the ties first: two sessions' altitudes are metres apart. No ties: no corrections.
std::vector<PoseCorrection> correctionsBy(const std::vector<PoseTie>& ties, const std::vector<CameraPose>& cameras,
                                          const std::vector<std::pair<std::size_t, std::size_t>>& neighbours,
                                          const CorrectionModel& model = {});

}  // namespace visual_localization
