#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include <Eigen/Core>

#include "visual_localization/geo/trajectory.h"
#include "visual_localization/localization/metric_pose.h"
#include "visual_localization/localization/query_image.h"
#include "visual_localization/localization/reason.h"
#include "visual_localization/localization/state.h"
#include "visual_localization/localization/tracker.h"

namespace visual_localization {

/// What a published pose rests on.
enum class PoseSource : std::uint8_t {
  kNone = 0,    ///< nothing in the image: a guess, or the motion since the last metric pose goes on
  kPlace = 1,   ///< the position of training images that look alike
  kMetric = 2,  ///< landmarks, from which the camera's pose was solved
};

/// "NONE", "PLACE", "METRIC".
std::string toString(PoseSource source);

/// Position and heading in the map frame.
struct PoseEstimate {
  Eigen::Vector2d position_m = Eigen::Vector2d::Zero();         ///< east, north
  double yaw_rad = 0.0;                                         ///< of the robot, 0 = east, ccw
  Eigen::Matrix2d covariance_m2 = Eigen::Matrix2d::Identity();  ///< of the position
  double yaw_variance_rad2 = 0.0;
  GeodeticPoint geodetic;  ///< the same position by the map's datum
};

/// Everything that is known after one image.
struct Estimate {
  std::int64_t stamp_ns = 0;  ///< of the image
  LocalizationState state = LocalizationState::kInitializing;
  PoseEstimate pose;
  TrackerEstimate tracked;                ///< what the tracker believes, and the best match
  Evidence evidence;                      ///< what verification says about it
  std::optional<double> threshold;        ///< the least probability that confirms; nothing where thresholds decide
  PlaceBelief belief;                     ///< where else the robot may be
  int unconfirmed = 0;                    ///< see StateAssessor::unconfirmed
  Why why;                                ///< the state is what it is
  PoseSource source = PoseSource::kNone;  ///< what `pose` rests on
  std::optional<MetricPose> metric;       ///< solved from landmarks in this image
  std::size_t images_since_metric = 0;    ///< 0 when this image has one
  double focal_scale = 1.0;          ///< focal length by the last images with a pose, as a share of the calibration's
  bool camera_contradicted = false;  ///< by them: no pose is metric
  bool other_lens = false;           ///< and the map was seen through another one: what looks alike is not as near
  double motion_residual_m = 0.0;    ///< see MotionConsistency; of the last estimates
  std::string session;               ///< of the map, that the next image is compared with; empty: all alike
  std::size_t comparisons = 0;       ///< distinct training images that particles or landmarks were compared with
  std::size_t swept = 0;             ///< distinct training images compared beside these, see MapSweep
  ImageReport image;                 ///< statistics, features, times
  double update_ms = 0.0;            ///< wall-clock time of all but extraction, comparisons and geometry
  std::size_t repeats = 0;           ///< images in a row, this one included, that repeated the one before
  bool frozen = false;               ///< too many of them: the camera must be broken

  /// Standard deviations of position (the larger one, metres) and heading (radians): in relation to the map when the
  /// pose is metric, otherwise of everything that is not known.
  double sigma_m() const;
  double sigmaYaw_rad() const;
  /// Name of the features that particles were compared by: "SIFT" or another kind of local ones, or "GLOBAL".
  std::string featuresName() const;
  /// What to tell people about a calibration that the images contradict; empty while they do not.
  std::string cameraTrouble() const;
};

}  // namespace visual_localization
