#pragma once

#include <atomic>
#include <memory>
#include <optional>
#include <string>

#include <ros/node_handle.h>
#include <ros/time.h>
#include <tf2/LinearMath/Transform.h>
#include <tf2_ros/buffer.h>
#include <tf2_ros/transform_broadcaster.h>
#include <tf2_ros/transform_listener.h>

#include "node/node_config.h"
#include "visual_localization/localization/estimate.h"

namespace visual_localization {

/// odom_in_map, such that odometry and map agree on where the robot is.
tf2::Transform odomInMap(const tf2::Transform& base_in_map, const tf2::Transform& base_in_odom);

/// Whether `estimate` may move the robot. `metric_only`: where landmarks can verify poses, a verified one alone may.
bool movesRobot(const Estimate& estimate, bool metric_only);

/// Broadcasts the estimate on tf as NodeConfig::tf_mode says. The tolerance may be set by any thread. When odometry is
/// needed and missing it broadcasts nothing: a guess would move the robot for everyone. After an estimate that may not
/// move the robot, odometry goes on from the last one that might.
class TransformPublisher {
 public:
  TransformPublisher(const NodeConfig& config, const ros::NodeHandle& node);

  void setTolerance(double transform_tolerance_s) { tolerance_s_ = transform_tolerance_s; }
  /// Time has gone back: the odometry in the buffer lies in the future.
  void forget();
  /// Another map: nothing is known of the robot in it.
  void forgetPose() { odom_in_map_.reset(); }
  /// `stamp` of the image. Returns why nothing was broadcast; empty when something was, or should not be.
  std::string publish(const Estimate& estimate, const ros::Time& stamp);

 private:
  std::string move(const PoseEstimate& pose, const ros::Time& stamp);
  std::string hold(const ros::Time& stamp);
  std::optional<tf2::Transform> baseInOdom(const ros::Time& stamp, std::string& reason) const;
  void broadcast(const tf2::Transform& child_in_map, const std::string& child, const ros::Time& stamp);

  const NodeConfig config_;
  std::atomic<double> tolerance_s_;
  tf2_ros::Buffer buffer_;
  std::unique_ptr<tf2_ros::TransformListener> listener_;  ///< only with odometry
  tf2_ros::TransformBroadcaster broadcaster_;
  std::optional<tf2::Transform> odom_in_map_;  ///< of the last estimate that moved the robot
  ros::Time last_stamp_;
  std::string last_reason_;  ///< why nothing was broadcast for that stamp
};

}  // namespace visual_localization
