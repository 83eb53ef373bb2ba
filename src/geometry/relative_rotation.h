#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "visual_localization/features/feature_matcher.h"
#include "visual_localization/geometry/camera_pose.h"

namespace visual_localization {

/// What two images of one static scene agree on.
struct TwoView {
  Eigen::Quaterniond b_from_a = Eigen::Quaterniond::Identity();  ///< turns directions of camera a into those of b
  Eigen::Vector3d travel = Eigen::Vector3d::Zero();              ///< from camera a to b, in the frame of b, of length 1
  std::vector<FeatureMatch> inliers;                             ///< matches that lie on each other's epipolar lines
};

/// Verifies matches by the essential matrix: RANSAC over samples of five matches, whose motion is found by descent
/// from any direction of travel without a turn (Botterill, Mills and Green 2011, BMVC), with random subsets of the
/// inliers wherever a motion is the best so far (Chum, Matas and Kittler 2003) and a robust least squares estimate at
/// the end. `a`, `b`: normalised image coordinates of all features, to which `matches` refer. `tolerance`, same unit:
/// the most of an inlier's distance from both lines together, twice that of Sampson (1982). Of the two rotations that
/// explain the matrix the smaller is taken: with little parallax the test of depths picks the twisted one. Nothing when
/// fewer than `min_inliers` remain or the cameras turn by more than `max_rotation_rad`. The result depends on the input
/// alone.
std::optional<TwoView> verifyTwoViews(const std::vector<Eigen::Vector2d>& a, const std::vector<Eigen::Vector2d>& b,
                                      const std::vector<FeatureMatch>& matches, double tolerance,
                                      std::size_t min_inliers, double max_rotation_rad);

/// How camera b is turned against camera a: turns directions in a's frame into those in b's.
struct RelativeRotation {
  std::uint32_t a = 0;
  std::uint32_t b = 0;
  Eigen::Quaterniond b_from_a = Eigen::Quaterniond::Identity();
  Eigen::Vector3d travel = Eigen::Vector3d::Zero();  ///< see TwoView; zero: not known
};

/// How a camera is mounted, and how well that is known.
struct Mounting {
  /// Of the camera, turned against a level one that looks where the robot does.
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
  Eigen::Vector3d sigma_rad{0.5, 0.5, 0.02};  ///< about the axes of the camera
};

/// As somebody said that it is: known better in roll than in pitch, and least in yaw (of the robot).
Mounting mountingOf(const SensorMount& mount);

/// Which way a robot drives at each image: 1 ahead, -1 backwards. Where the course turns about and the images do not,
/// it reverses; it drives ahead most of the time.
std::vector<double> drivingDirections(const std::vector<double>& courses_rad,
                                      const std::vector<RelativeRotation>& relative);

/// How a camera that nobody described is mounted, by its images: the axis about which they turn where the robot turns
/// is up, and the direction in which they move where it drives straight is ahead. `headings_rad`: of the robot at each
/// image. In the frame of the robot (see SensorMount). Nothing where the drive turns too little to tell, or the images
/// do not agree.
std::optional<Eigen::Quaterniond> mountingByImages(const std::vector<double>& headings_rad,
                                                   const std::vector<double>& directions,
                                                   const std::vector<RelativeRotation>& relative);

/// What the directions of the cameras come to.
struct AveragedRotations {
  std::vector<Eigen::Quaterniond> camera_in_map;
  /// How the camera is mounted: turned against how it was said to be, as a rotation vector in its frame, radians.
  Eigen::Vector3d mounting_rad = Eigen::Vector3d::Zero();
};

/// Rotations of all cameras from relative rotations and the directions of travel (`travel_yaws_rad`, 0 = east,
/// counter-clockwise), of which both may be wrong here and there (Cauchy losses). The mounting is one for all cameras.
AveragedRotations averageRotations(const std::vector<double>& travel_yaws_rad,
                                   const std::vector<RelativeRotation>& relative, const Mounting& mounting = {});

}  // namespace visual_localization
