#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "visual_localization/geometry/camera_pose.h"

namespace visual_localization {

/// A landmark and where the image seems to show it.
struct LandmarkMatch {
  std::size_t keypoint = 0;                                 ///< of the image
  int session = 0;                                          ///< of the map, whose landmark it is
  Eigen::Vector2d normalised = Eigen::Vector2d::Zero();     ///< x/z, y/z in the camera's frame
  double sigma = 1.0;                                       ///< of each coordinate
  Eigen::Vector3d landmark_m = Eigen::Vector3d::Zero();     ///< map frame
  Eigen::Matrix3d covariance_m2 = Eigen::Matrix3d::Zero();  ///< of the landmark, map frame
};

/// A camera's pose and how well it is known.
struct SolvedPose {
  CameraPose camera;
  /// Position (map frame, metres), then rotation about the map's axes (radians).
  Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Zero();
  std::vector<std::size_t> inliers;  ///< of the matches; where landmarks moved, those more probably right than wrong
  std::size_t agreeing = 0;          ///< matches within the tolerance of one pose: how little that is chance
  double median_error = 0.0;         ///< distance of an inlier from its landmark's projection, normalised coordinates
  /// What the inliers would rather have as focal length, as a share of the calibration's, and its standard deviation.
  double focal_scale = 1.0;
  double focal_sigma = 0.0;
  /// Logarithm of how many times as likely the matches are where landmarks moved as in a rigid scene; 0: unknown.
  double moving_gain = 0.0;
};

/// The pose from which most matches are right, the nearer the better: AP3P in RANSAC, then least squares on all
/// inliers, each weighed by its own and its landmark's covariance (Cauchy loss). Each session of a map has its own
/// landmark of one thing, but a keypoint shows it once: of its matches only those of the session count that agrees
/// best. Where landmarks that moved since the day of the map explain the matches far better, all matches decide, and
/// the covariance grows. `tolerance`: farthest of an inlier from its landmark's projection, normalised coordinates.
/// `moving_evidence`: what images before tell of that, added to the gain of this one. Nothing with fewer than
/// `min_inliers` (at least 4), or when they leave the pose open. The result depends on the input alone.
std::optional<SolvedPose> solvePose(const std::vector<LandmarkMatch>& matches, double tolerance,
                                    std::size_t min_inliers, double moving_evidence = 0.0);

}  // namespace visual_localization
