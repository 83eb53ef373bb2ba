#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

#include <Eigen/Core>

#include "visual_localization/localization/metric_pose.h"
#include "visual_localization/localization/odometry.h"

namespace visual_localization {

/// A pose that no image verifies.
struct PredictedPose {
  Eigen::Vector2d position_m = Eigen::Vector2d::Zero();
  double yaw_rad = 0.0;
  double sigma_m = 0.0;                                     ///< of each axis of the way since the last verified pose
  Eigen::Matrix2d covariance_m2 = Eigen::Matrix2d::Zero();  ///< of all of it, the map's own included
  double yaw_variance_rad2 = 0.0;
  bool by_odometry = false;
};

/// Where the motion since the last verified pose leads, by odometry or by the velocity before, and whether a pose that
/// landmarks verify may be where the robot has driven to.
class PosePredictor {
 public:
  static constexpr double kMaxGap_s = 5.0;  ///< between images: after a longer one a velocity tells nothing

  explicit PosePredictor(const MetricConfig& config) : config_(config) {}

  void configure(const MetricConfig& config) { config_ = config; }
  /// How far odometry moves since the last verified pose are believed, from now on. Until then there is none. `track`
  /// must outlive it.
  void useOdometry(const OdometryTrack& track, const OdometryConfig& config);
  /// The robot may be anywhere: forgets the last verified pose. How far odometry is believed does not depend on where
  /// the robot is, and stays.
  void reset() { last_.reset(); }
  /// For a while nothing was seen: the velocity no longer holds, but what odometry says of the way since does.
  void doubtMotion();
  /// The next image, taken at this time.
  void startImage(std::int64_t stamp_ns);

  /// Nothing while odometry is not believed, or when it bridges no such way.
  std::optional<PredictedPose> byOdometry() const;
  /// Nothing when the last verified pose was longer ago than a velocity holds.
  std::optional<PredictedPose> byVelocity() const;
  /// By odometry, or else by the velocity.
  std::optional<PredictedPose> predicted() const;

  /// By odometry or by the velocity before; of a robot that turned as this pose says, along the arc.
  bool isPredicted(const MetricPose& pose) const;
  /// Whether the robot may have driven here since the last verified pose: it is where the motion leads, or after a
  /// short way no farther than by the speed that it had.
  bool follows(const MetricPose& pose) const;
  /// Whether the landmarks may be those of a thing that was moved since the day of the map, a parked car: the motion is
  /// known from the last two images, and the pose is beside where it leads. A robot that was pushed aside is there in
  /// the next image as well, and a kidnapped one is farther away.
  bool isBesidePrediction(const MetricPose& pose) const;
  /// The pose of the image is verified: motions lead from here from now on. Whether the motion so far allows to be sure
  /// of it: not while odometry that was believed led elsewhere a few poses ago.
  bool add(const MetricPose& pose);
  /// Images since the last verified one; 0 when it was the last. No reset changes it.
  std::size_t imagesSince() const { return images_since_; }

 private:
  struct Known {
    std::int64_t stamp_ns = 0;
    MetricPose pose;
    std::optional<Eigen::Vector2d> velocity_mps;
    double turned_rad = 0.0;  ///< on the way that tells the velocity
    bool velocity_holds = true;
  };

  std::optional<bool> odometryAgrees(const MetricPose& pose) const;
  void judgeOdometry(bool agrees);
  bool isElsewhere(const MetricPose& pose, std::optional<bool> odometry_agrees);

  MetricConfig config_;
  std::optional<Known> last_;
  const OdometryTrack* odometry_ = nullptr;
  OdometryConfig odometry_config_;
  std::size_t distrust_ = 0;   ///< verified poses that odometry must agree with before it is believed again
  std::size_t elsewhere_ = 0;  ///< verified poses that must follow before one that odometry contradicts is confirmed
  std::optional<double> speed_mps_;  ///< of the last two verified poses that agree about it
  std::size_t images_since_ = 0;
  std::int64_t stamp_ns_ = 0;
};

}  // namespace visual_localization
