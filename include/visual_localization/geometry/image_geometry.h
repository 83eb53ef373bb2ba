#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "visual_localization/geometry/camera_pose.h"
#include "visual_localization/geometry/fix_budget.h"
#include "visual_localization/parameters/parameters.h"

namespace visual_localization {

/// How landmarks and poses of a map come from its images and fixes.
struct GeometryConfig {
  bool enabled = true;
  bool self_calibration = false;
  double focal_sigma = 0.03;
  double principal_point_sigma = 0.01;
  double distortion_sigma = 0.05;
  double fix_sigma_m = 0.0;
  int window = 2000;  ///< images adjusted at a time, which bounds the memory; no parameter
  double spacing_m = 2.0;

  void declare(ParameterVisitor& visitor);
};

/// A landmark that an image of the map shows.
struct SeenLandmark {
  std::uint32_t feature = 0;  ///< index among the image's SIFT features
  std::uint32_t id = 0;       ///< the same in all images of the map that show it
  /// From the camera's optical centre, along the axes of the map (east, north, up): small numbers are exact as floats.
  Eigen::Vector3f offset_m = Eigen::Vector3f::Zero();
  float sigma_along_m = 0.0F;   ///< standard deviation along the ray from this camera, relative to this camera
  float sigma_across_m = 0.0F;  ///< the same across the ray, in either direction
};

/// What the adjustment found out about an image: its camera's pose and the landmarks that it shows.
struct ImageGeometry {
  CameraPose camera;
  /// Of the pose in the map frame: position (east, north, up; metres), then rotation about these axes (radians).
  Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Zero();
  std::vector<SeenLandmark> landmarks;  ///< in order of the feature, each feature at most once
};

/// What the adjustment of a session came to; all zero when its camera is not calibrated.
struct SessionLandmarks {
  std::size_t located = 0;  ///< images with a pose and landmarks
  std::size_t landmarks = 0;
  std::size_t observations = 0;          ///< features that show one
  bool contradicts_calibration = false;  ///< no lens near it explains the images: the session has places only
  /// How far from it, in sigmas of a calibration: focal length, ratio of fy to fx, principal point x and y, k1, k2.
  Eigen::Matrix<double, 6, 1> lens_sigmas = Eigen::Matrix<double, 6, 1>::Zero();
  bool contradicts_fixes = false;  ///< too many images do: likewise
  std::size_t off_fixes = 0;       ///< images that are elsewhere than believed fixes around have them
  std::size_t unexplained = 0;     ///< images without landmarks since too little around them fits together
  double focal_scale = 1.0;        ///< what the images say the focal length is, as a share of the calibration's
  double focal_sigma = 0.0;        ///< of that; 0: it stays as it is published, the images do not tell
  double median_error_px = 0.0;    ///< distance of an observation from its landmark's projection
  double mean_shift_m = 0.0;       ///< of these images from the cleaned path
  double largest_shift_m = 0.0;
  double fix_delay_s = 0.0;    ///< fixes say where the antenna was this long before their stamps
  double delay_sigma_s = 0.0;  ///< of that; 0: the images do not tell it from none
  /// How the images turn the camera against the mounting that was said: about the axes right, down and ahead of a level
  /// camera that looks where the robot does.
  Eigen::Vector3d mounting_off_rad = Eigen::Vector3d::Zero();
  /// How the camera is turned on the robot, when nobody said and the images tell that it does not look level and ahead.
  std::optional<CameraPose> found_camera = {};
  double tied_apart_m = 0.0;    ///< from what the sessions before see as well, before they were tied; 0: not tied
  double agreeing_share = 1.0;  ///< of the features matched over several images: those that the adjustment explains
  std::vector<DoubtfulStretch> doubtful = {};  ///< in order of time
};

}  // namespace visual_localization
