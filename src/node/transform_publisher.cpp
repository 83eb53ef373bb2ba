#include "node/transform_publisher.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <stdexcept>
#include <thread>

#include <geometry_msgs/TransformStamped.h>
#include <tf2/exceptions.h>
#include <tf2/utils.h>
#include <tf2_geometry_msgs/tf2_geometry_msgs.h>

#include "base/time.h"
#include "localization/covariance.h"

namespace visual_localization {
namespace {

/// How long an image waits for odometry of its stamp, in wall time: simulated time may stand still.
constexpr std::chrono::milliseconds kOdometryWait{100};
/// The same while there has never been odometry: every image would wait in vain.
constexpr std::chrono::milliseconds kUnknownOdometryWait{20};
constexpr std::chrono::milliseconds kOdometryPoll{5};
constexpr double kSlidingSigmas = 3.0;

tf2::Transform planar(double x_m, double y_m, double yaw_rad) {
  return tf2::Transform(tf2::Quaternion(tf2::Vector3(0.0, 0.0, 1.0), yaw_rad), tf2::Vector3(x_m, y_m, 0.0));
}

tf2::Transform baseInMap(const PoseEstimate& pose) {
  return planar(pose.position_m.x(), pose.position_m.y(), pose.yaw_rad);
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

void SlidingCorrection::aimAt(const tf2::Transform& odom_in_map, const tf2::Transform& base_in_odom, double sigma_m,
                              double sigma_yaw_rad) {
  target_ = odom_in_map;
  if (shown_) {
    const tf2::Transform left = (*shown_ * base_in_odom).inverseTimes(target_ * base_in_odom);
    const double way_sigma_m = std::hypot(sigma_m, odometry_.distance_sigma * way_m_);
    const double way_sigma_rad = std::hypot(sigma_yaw_rad, odometry_.turn_sigma_rad_m * way_m_);
    const bool elsewhere = std::hypot(left.getOrigin().x(), left.getOrigin().y()) > kSlidingSigmas * way_sigma_m ||
                           std::abs(tf2::getYaw(left.getRotation())) > kSlidingSigmas * way_sigma_rad;
    if (elsewhere) shown_.reset();
  }
  way_m_ = 0.0;
}

/// The robot is moved, not the origin of the odometry: far from it a small turn would be a long way.
tf2::Transform SlidingCorrection::after(double elapsed_s, const tf2::Transform& base_in_odom) {
  if (base_in_odom_) way_m_ += (base_in_odom.getOrigin() - base_in_odom_->getOrigin()).length();
  base_in_odom_ = base_in_odom;
  if (!shown_) shown_ = target_;
  const double share = smoothing_s_ > 0.0 ? 1.0 - std::exp(-std::max(0.0, elapsed_s) / smoothing_s_) : 1.0;
  const tf2::Transform shown_base = *shown_ * base_in_odom;
  const tf2::Transform left = shown_base.inverseTimes(target_ * base_in_odom);
  const tf2::Transform step(tf2::Quaternion::getIdentity().slerp(left.getRotation(), share), share * left.getOrigin());
  shown_ = odomInMap(shown_base * step, base_in_odom);
  return *shown_;
}

TransformPublisher::TransformPublisher(const NodeParameters& parameters, const ros::NodeHandle& node)
    : config_(parameters.node),
      between_images_(config_.tf_mode == "map_to_odom" && config_.tf_rate_hz > 0.0),
      tolerance_s_(config_.transform_tolerance_s),
      image_timeout_s_(config_.image_timeout_s),
      odometry_(parameters.localizer.odometry),
      correction_(config_.tf_smoothing_s, odometry_) {
  if (config_.tf_mode == "map_to_odom") listener_ = std::make_unique<tf2_ros::TransformListener>(buffer_, node);
  if (!between_images_) return;
  ros::NodeHandle timer_node(node);
  timer_node.setCallbackQueue(&queue_);
  timer_ = timer_node.createSteadyTimer(ros::WallDuration(1.0 / config_.tf_rate_hz),
                                        [this](const ros::SteadyTimerEvent&) { broadcastBetween(ros::Time::now()); });
  spinner_ = std::make_unique<ros::AsyncSpinner>(1, &queue_);
  spinner_->start();
}

TransformPublisher::~TransformPublisher() {
  timer_.stop();
  spinner_.reset();
}

void TransformPublisher::configure(const NodeParameters& parameters) {
  tolerance_s_ = parameters.node.transform_tolerance_s;
  image_timeout_s_ = parameters.node.image_timeout_s;
  const std::lock_guard<std::mutex> lock(mutex_);
  odometry_ = parameters.localizer.odometry;
  correction_.configure(odometry_);
}

void TransformPublisher::forget() {
  buffer_.clear();
  last_stamp_ = ros::Time();
  forgetPose();
}

void TransformPublisher::forgetPose() {
  const std::lock_guard<std::mutex> lock(mutex_);
  odom_in_map_.reset();
  correction_ = SlidingCorrection(config_.tf_smoothing_s, odometry_);
  last_between_ = ros::Time();
  trouble_between_.clear();
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
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    odom_in_map_ = odomInMap(baseInMap(pose), *base_in_odom);
    correction_.aimAt(*odom_in_map_, *base_in_odom, largerSigma(pose.covariance_m2), std::sqrt(pose.yaw_variance_rad2));
  }
  return hold(stamp);
}

/// Without odometry nobody knows where the robot has gone since.
std::string TransformPublisher::hold(const ros::Time& stamp) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (!odom_in_map_) return "no metric pose while tracking (tf_metric_only)";
  if (!between_images_) {
    broadcast(*odom_in_map_, config_.odom_frame_id, stamp);
    return {};
  }
  last_image_ = std::chrono::steady_clock::now();
  return trouble_between_;
}

/// Without images for long odometry alone says too little: who waits for the transform then stops.
void TransformPublisher::broadcastBetween(const ros::Time& now) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (!odom_in_map_ || now == last_between_) return;  // simulated time may stand still
  const std::chrono::duration<double> silence = std::chrono::steady_clock::now() - last_image_;
  if (silence.count() > image_timeout_s_) return;
  const auto base_in_odom = lookUpBaseInOdom(ros::Time(), trouble_between_);
  if (!base_in_odom) return;
  const double elapsed_s = secondsBetween(static_cast<std::int64_t>(last_between_.toNSec()),
                                          static_cast<std::int64_t>(now.toNSec()));  // ros::Duration ends at 68 years
  broadcast(correction_.after(elapsed_s, *base_in_odom), config_.odom_frame_id, now);
  last_between_ = now;
}

std::optional<tf2::Transform> TransformPublisher::baseInOdom(const ros::Time& stamp, std::string& reason) const {
  const tf2::BufferCore& transforms = buffer_;
  const bool is_known = transforms.canTransform(config_.odom_frame_id, config_.base_frame_id, ros::Time());
  const auto deadline = std::chrono::steady_clock::now() + (is_known ? kOdometryWait : kUnknownOdometryWait);
  while (!transforms.canTransform(config_.odom_frame_id, config_.base_frame_id, stamp) &&
         std::chrono::steady_clock::now() < deadline) {
    std::this_thread::sleep_for(kOdometryPoll);
  }
  return lookUpBaseInOdom(stamp, reason);
}

std::optional<tf2::Transform> TransformPublisher::lookUpBaseInOdom(const ros::Time& stamp, std::string& reason) const {
  try {
    const tf2::BufferCore& transforms = buffer_;
    tf2::Transform base_in_odom;
    tf2::fromMsg(transforms.lookupTransform(config_.odom_frame_id, config_.base_frame_id, stamp).transform,
                 base_in_odom);
    reason.clear();
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
