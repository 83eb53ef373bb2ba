#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>

#include "visual_localization/geometry/camera_pose.h"
#include "visual_localization/parameters/parameters.h"

namespace visual_localization {

/// The standard deviation along the longer axis of the error ellipse.
inline double largerSigma(const Eigen::Matrix2d& covariance) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> eigen(covariance, Eigen::EigenvaluesOnly);
  return std::sqrt(std::max(0.0, eigen.eigenvalues().maxCoeff()));
}

/// A landmark that was matched with a feature of an image.
struct MatchedLandmark {
  Eigen::Vector2f seen_px = Eigen::Vector2f::Zero();  ///< that feature, pixels of the map's image size
  std::uint32_t training_feature = 0;                 ///< what shows it in the training image, index of a local feature
  bool inlier = false;                                ///< agrees with the pose
};

/// The landmarks of one training image that were matched with an image.
struct MatchedLandmarks {
  std::size_t training_image = 0;
  std::vector<MatchedLandmark> landmarks;
};

/// When a pose solved from landmarks counts. What has a comment is no parameter.
struct MetricConfig {
  std::string pose_source = "metric";
  int training_images = 5;         ///< whose landmarks are matched: more of them cost more and show the same
  int min_inliers = 20;            ///< a pose on fewer landmarks is not believed
  int min_inliers_predicted = 12;  ///< where the motion leads: fewer agree there by chance than anywhere
  int min_inliers_tracking = 80;
  double sigma_factor = 1.4;            ///< of the covariance, as if one by one: landmarks of one image err alike
  double max_sigma_m = 0.3;             ///< landmarks that leave more open hardly fix the pose
  double max_prediction_error_m = 1.0;  ///< beside half the way since and twice the sigma of the pose
  double max_focal_error = 0.01;        ///< one image of a street tells the focal length to about 1 %

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
  bool confirmed = false;  ///< enough inliers, those of the poses before that it follows included
  /// Median distance of an inlier from its landmark's projection, pixels of the map's size.
  double reprojection_px = 0.0;

  /// The larger standard deviation of the horizontal position in relation to the map, metres.
  double sigma_m() const;
  /// Standard deviation of the heading in relation to the map, radians.
  double sigmaYaw_rad() const;
  /// The same of the map itself.
  double mapSigma_m() const;
  double mapSigmaYaw_rad() const;
};

}  // namespace visual_localization
