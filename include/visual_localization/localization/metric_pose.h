#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include <Eigen/Core>

#include "visual_localization/geometry/camera_pose.h"
#include "visual_localization/parameters/parameter_visitor.h"

namespace visual_localization {

/// What a published pose rests on.
enum class PoseSource : std::uint8_t {
  kNone = 0,    ///< nothing in the image: a guess, or the motion since the last metric pose goes on
  kPlace = 1,   ///< the position of training images that look alike
  kMetric = 2,  ///< landmarks, from which the camera's pose was solved
};

/// "NONE", "PLACE", "METRIC".
std::string toString(PoseSource source);

/// When a pose solved from landmarks counts.
struct MetricConfig {
  std::string pose_source = "metric";
  int training_images = 5;
  double match_ratio = 0.85;
  double tolerance_px = 3.0;
  double keypoint_sigma_px = 0.3;
  int min_inliers = 20;
  int min_inliers_predicted = 12;
  double sigma_factor = 1.4;
  double max_sigma_m = 0.3;
  double max_gap_s = 5.0;
  double max_prediction_error_m = 2.0;
  double max_focal_error = 0.01;

  void declare(ParameterVisitor& visitor);
};

/// A pose solved from landmarks.
struct MetricPose {
  using Covariance = Eigen::Matrix<double, 6, 6>;

  CameraPose camera;                                       ///< map frame
  Eigen::Isometry3d base = Eigen::Isometry3d::Identity();  ///< the robot's frame (x ahead, y left, z up) in the map
  /// Of `base`, in relation to the map around: position (east, north, up; metres), then rotation about these axes
  /// (radians). An error of its own for each image: the one to fuse.
  Covariance covariance = Covariance::Zero();
  /// Of the map there, the same for images near each other: no average takes it away.
  Covariance map_covariance = Covariance::Zero();
  std::size_t inliers = 0;
  bool confirmed = false;  ///< by the motion since the last pose, or by twice the inliers that are asked for
  double reprojection_px =
      0.0;  ///< median distance of an inlier from its landmark's projection, pixels of the map's size

  /// The larger standard deviation of the horizontal position in relation to the map, metres.
  double sigma_m() const;
  /// Standard deviation of the heading in relation to the map, radians.
  double sigmaYaw_rad() const;
  /// The same of the map itself.
  double mapSigma_m() const;
  double mapSigmaYaw_rad() const;
};

}  // namespace visual_localization
