#include "node/transform_publisher.h"

#include <chrono>
#include <stdexcept>
#include <thread>

#include <geometry_msgs/TransformStamped.h>
#include <tf2/exceptions.h>
#include <tf2_geometry_msgs/tf2_geometry_msgs.h>

namespace visual_localization {
namespace {

/// How long an image waits for odometry of its stamp, in wall time: simulated time may stand still.
constexpr std::chrono::milliseconds kOdometryWait{100};
/// The same while there has never been odometry: every image would wait in vain.
constexpr std::chrono::milliseconds kUnknownOdometryWait{20};
constexpr std::chrono::milliseconds kOdometryPoll{5};

tf2::Transform baseInMap(const PoseEstimate& pose) {
  return tf2::Transform(tf2::Quaternion(tf2::Vector3(0.0, 0.0, 1.0), pose.yaw_rad),
                        tf2::Vector3(pose.position_m.x(), pose.position_m.y(), 0.0));
}

}  // namespace

tf2::Transform odomInMap(const tf2::Transform& base_in_map, const tf2::Transform& base_in_odom) {
  return base_in_map * base_in_odom.inverse();
}

bool movesRobot(const Estimate& estimate, bool metric_only) {
  const bool is_verifiable = estimate.evidence.verified.has_value() || estimate.camera_contradicted;
  if (!metric_only || !is_verifiable) return true;
  return estimate.source == PoseSource::kMetric && estimate.state == LocalizationState::kTracking;
}

TransformPublisher::TransformPublisher(const NodeConfig& config, const ros::NodeHandle& node)
    : config_(config), tolerance_s_(config.transform_tolerance_s) {
  if (config_.tf_mode == "map_to_odom") listener_ = std::make_unique<tf2_ros::TransformListener>(buffer_, node);
}

void TransformPublisher::forget() {
  buffer_.clear();
  last_stamp_ = ros::Time();
  forgetPose();
}

std::string TransformPublisher::publish(const Estimate& estimate, const ros::Time& stamp) {
  if (config_.tf_mode == "none") return {};
  if (stamp == last_stamp_) return last_reason_;  // tf2 complains about a second transform for the same stamp
  last_stamp_ = stamp;
  last_reason_ = movesRobot(estimate, config_.tf_metric_only) ? move(estimate.pose, stamp) : hold(stamp);
  return last_reason_;
}

std::string TransformPublisher::move(const PoseEstimate& pose, const ros::Time& stamp) {
  if (config_.tf_mode == "map_to_base") {
    broadcast(baseInMap(pose), config_.base_frame_id, stamp);
    return {};
  }
  std::string reason;
  const auto base_in_odom = baseInOdom(stamp, reason);
  if (!base_in_odom) return reason;
  odom_in_map_ = odomInMap(baseInMap(pose), *base_in_odom);
  broadcast(*odom_in_map_, config_.odom_frame_id, stamp);
  return {};
}

/// Without odometry nobody knows where the robot has gone since.
std::string TransformPublisher::hold(const ros::Time& stamp) {
  if (!odom_in_map_) return "no metric pose while tracking (tf_metric_only)";
  broadcast(*odom_in_map_, config_.odom_frame_id, stamp);
  return {};
}

std::optional<tf2::Transform> TransformPublisher::baseInOdom(const ros::Time& stamp, std::string& reason) const {
  const tf2::BufferCore& transforms = buffer_;
  const bool is_known = transforms.canTransform(config_.odom_frame_id, config_.base_frame_id, ros::Time());
  const auto deadline = std::chrono::steady_clock::now() + (is_known ? kOdometryWait : kUnknownOdometryWait);
  while (!transforms.canTransform(config_.odom_frame_id, config_.base_frame_id, stamp) &&
         std::chrono::steady_clock::now() < deadline) {
    std::this_thread::sleep_for(kOdometryPoll);
  }
  try {
    tf2::Transform base_in_odom;
    tf2::fromMsg(transforms.lookupTransform(config_.odom_frame_id, config_.base_frame_id, stamp).transform,
                 base_in_odom);
    return base_in_odom;
  } catch (const tf2::TransformException& error) {
    reason = "no transform from " + config_.odom_frame_id + " to " + config_.base_frame_id + ": " + error.what();
    return std::nullopt;
  }
}

void TransformPublisher::broadcast(const tf2::Transform& child_in_map, const std::string& child,
                                   const ros::Time& stamp) {
  geometry_msgs::TransformStamped message;
  message.header.frame_id = config_.global_frame_id;
  message.child_frame_id = child;
  message.transform = tf2::toMsg(child_in_map);
  try {
    message.header.stamp = stamp + ros::Duration(tolerance_s_);
  } catch (const std::runtime_error&) {
    message.header.stamp = stamp;  // at the end of what a stamp can hold
  }
  broadcaster_.sendTransform(message);
}

}  // namespace visual_localization
