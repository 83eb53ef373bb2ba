#pragma once

#include <atomic>
#include <chrono>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include <ros/callback_queue.h>
#include <ros/node_handle.h>
#include <ros/spinner.h>
#include <ros/steady_timer.h>
#include <ros/time.h>
#include <tf2/LinearMath/Transform.h>
#include <tf2_ros/buffer.h>
#include <tf2_ros/transform_broadcaster.h>
#include <tf2_ros/transform_listener.h>

#include "node/node_config.h"
#include "visual_localization/localization/estimate.h"
#include "visual_localization/localization/odometry.h"

namespace visual_localization {

/// odom_in_map, such that odometry and map agree on where the robot is.
tf2::Transform odomInMap(const tf2::Transform& base_in_map, const tf2::Transform& base_in_odom);

/// Whether `estimate` may move the robot. `metric_only`: where landmarks can verify poses, a verified one alone may.
bool movesRobot(const Estimate& estimate, bool metric_only);

/// odom_in_map between images. A correction within three standard deviations, of the pose that it comes from and of the
/// way by odometry since the one before, moves the robot little by little; a larger one means that the robot is
/// elsewhere, and moves it at once.
class SlidingCorrection {
 public:
  /// `smoothing_s`: time constant; after it 37 % of a correction are left. 0: at once.
  SlidingCorrection(double smoothing_s, const OdometryConfig& odometry)
      : smoothing_s_(smoothing_s), odometry_(odometry) {}

  /// What odometry drifts from now on.
  void configure(const OdometryConfig& odometry) { odometry_ = odometry; }
  /// From now on towards this one. The standard deviations are those of the pose, of each axis and of the heading.
  /// Heights and tilts of the odometry are never a reason to be elsewhere.
  void aimAt(const tf2::Transform& odom_in_map, const tf2::Transform& base_in_odom, double sigma_m,
             double sigma_yaw_rad);
  /// The transform `elapsed_s` after the last call, with the robot at `base_in_odom`. To be called after aimAt().
  tf2::Transform after(double elapsed_s, const tf2::Transform& base_in_odom);

 private:
  double smoothing_s_;
  OdometryConfig odometry_;
  tf2::Transform target_ = tf2::Transform::getIdentity();
  std::optional<tf2::Transform> shown_;
  std::optional<tf2::Transform> base_in_odom_;  ///< at the last call
  double way_m_ = 0.0;                          ///< by odometry, since the last aim
};

/// Broadcasts the estimate on tf as NodeConfig::tf_mode says: with each image, or with map_to_odom at
/// NodeConfig::tf_rate, from a thread of its own. When there is no odometry at an image's time it broadcasts nothing
/// new: a guess would move the robot for everyone. After an estimate that may not move the robot, odometry goes on from
/// the last one that might.
class TransformPublisher {
 public:
  TransformPublisher(const NodeParameters& parameters, const ros::NodeHandle& node);
  ~TransformPublisher();

  /// What can change while it runs: tolerance, timeout and what odometry drifts. From any thread.
  void configure(const NodeParameters& parameters);
  /// Time has gone back: the odometry in the buffer lies in the future.
  void forget();
  /// Another map: nothing is known of the robot in it. From any thread.
  void forgetPose();
  /// `stamp` of the image. Returns why nothing is broadcast; empty when something is, or should not be.
  std::string publish(const Estimate& estimate, const ros::Time& stamp);

 private:
  std::string move(const PoseEstimate& pose, const ros::Time& stamp);
  std::string hold(const ros::Time& stamp);
  /// Waits a moment for it.
  std::optional<tf2::Transform> baseInOdom(const ros::Time& stamp, std::string& reason) const;
  /// `stamp` 0: the newest. `reason`: why there is none, otherwise empty.
  std::optional<tf2::Transform> lookUpBaseInOdom(const ros::Time& stamp, std::string& reason) const;
  void broadcastBetween(const ros::Time& now);
  void broadcast(const tf2::Transform& child_in_map, const std::string& child, const ros::Time& stamp);

  const NodeConfig config_;
  const bool between_images_;  ///< instead of with them
  std::atomic<double> tolerance_s_;
  std::atomic<double> image_timeout_s_;
  tf2_ros::Buffer buffer_;
  std::unique_ptr<tf2_ros::TransformListener> listener_;  ///< only with odometry
  tf2_ros::TransformBroadcaster broadcaster_;
  ros::Time last_stamp_;
  std::string last_reason_;  ///< why nothing was broadcast for that stamp
  std::mutex mutex_;         ///< of all that follows, until the next comment
  OdometryConfig odometry_;
  std::optional<tf2::Transform> odom_in_map_;         ///< of the last estimate that moved the robot
  SlidingCorrection correction_;                      ///< where that is known
  ros::Time last_between_;                            ///< broadcast
  std::chrono::steady_clock::time_point last_image_;  ///< that was no frozen camera's
  std::string trouble_between_;
  // Of the timer.
  ros::CallbackQueue queue_;
  ros::SteadyTimer timer_;
  std::unique_ptr<ros::AsyncSpinner> spinner_;  ///< nothing that waits for an image may hold it up
};

}  // namespace visual_localization
