#include "node/localizer_publisher.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <stdexcept>

#include <cv_bridge/cv_bridge.h>
#include <geometry_msgs/TransformStamped.h>
#include <sensor_msgs/image_encodings.h>
#include <tf2/utils.h>
#include <tf2_geometry_msgs/tf2_geometry_msgs.h>

#include "base/time.h"
#include "node/drawings.h"
#include "node/message_conversions.h"
#include "node/stamps.h"
#include "visual_localization/localization/estimate.h"

namespace visual_localization {
namespace {

constexpr double kSlidingSigmas = 3.0;
constexpr double kSmoothing_s = 0.5;  ///< until 37 % of a correction are left: smooth, and soon true

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

/// About the robot, not about the origin of the odometry: far from it a small turn would be a long way.
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

TransformPublisher::TransformPublisher(const NodeParameters& parameters, const ros::NodeHandle& node, ThrottledLog& log)
    : config_(parameters.node),
      log_(log),
      between_images_(config_.tf_mode == "map_to_odom" && config_.tf_rate_hz > 0.0),
      tolerance_s_(config_.transform_tolerance_s),
      image_timeout_s_(config_.image_timeout_s),
      transforms_(config_.odom_frame_id, config_.base_frame_id, log),
      odometry_(parameters.localizer.odometry),
      correction_(kSmoothing_s, odometry_) {
  if (config_.tf_mode == "map_to_odom") listener_.emplace(node, transforms_, log, [this] { odometryCame(); });
  if (!between_images_) return;
  ros::NodeHandle timer_node(node);
  timer_node.setCallbackQueue(&queue_);
  timer_ =
      timer_node.createSteadyTimer(ros::WallDuration(1.0 / config_.tf_rate_hz), [this](const ros::SteadyTimerEvent&) {
        guarded(log_, "transform", [this] { broadcastBetween(ros::Time::now()); });
      });
  spinner_ = std::make_unique<ros::AsyncSpinner>(1, &queue_);
  spinner_->start();
}

TransformPublisher::~TransformPublisher() {
  listener_.reset();
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
  transforms_.forget();
  last_stamp_ = ros::Time();
  forgetPose();
}

void TransformPublisher::forgetPose() {
  const std::lock_guard<std::mutex> lock(mutex_);
  late_.clear();
  odom_in_map_.reset();
  correction_ = SlidingCorrection(kSmoothing_s, odometry_);
  last_between_ = ros::Time();
  trouble_between_.clear();
}

std::string TransformPublisher::publish(const Estimate& estimate, const ros::Time& stamp) {
  if (config_.tf_mode == "none") return {};
  if (stamp == last_stamp_) return last_reason_;  // tf2 complains about a second transform for the same stamp
  last_stamp_ = stamp;
  const std::lock_guard<std::mutex> lock(mutex_);
  last_reason_ = movesRobot(estimate, config_.tf_metric_only) ? move(estimate.pose, stamp) : hold(stamp);
  return last_reason_;
}

std::string TransformPublisher::move(const PoseEstimate& pose, const ros::Time& stamp) {
  if (config_.tf_mode == "map_to_base") {
    broadcast(baseInMap(pose), config_.base_frame_id, stamp);
    return {};
  }
  const auto now = std::chrono::steady_clock::now();
  late_.await(pose, stamp, now);
  if (moveByOdometry()) return trouble_between_;
  if (transforms_.knows(ros::Time()) && !late_.isMissing(now)) return {};  // it will come
  std::string reason;
  lookUpBaseInOdom(stamp, reason);
  return reason;
}

bool TransformPublisher::moveByOdometry() {
  const auto known = late_.take(transforms_);
  if (!known) return false;
  odom_in_map_ = odomInMap(baseInMap(known->pose), known->base_in_odom);
  correction_.aimAt(*odom_in_map_, known->base_in_odom, largerSigma(known->pose.covariance_m2),
                    std::sqrt(known->pose.yaw_variance_rad2));
  hold(known->stamp);
  return true;
}

void TransformPublisher::odometryCame() {
  const std::lock_guard<std::mutex> lock(mutex_);
  moveByOdometry();
}

/// Repeats the last map_to_odom; of map_to_base nothing, since without odometry the robot may be elsewhere by now.
std::string TransformPublisher::hold(const ros::Time& stamp) {
  if (!odom_in_map_) return "no metric pose while tracking (tf_metric_only)";
  if (!between_images_) {
    broadcast(*odom_in_map_, config_.odom_frame_id, stamp);
    return {};
  }
  last_image_ = std::chrono::steady_clock::now();
  return trouble_between_;
}

/// Not after a long silence of the images: odometry alone is not enough then.
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

std::optional<tf2::Transform> TransformPublisher::lookUpBaseInOdom(const ros::Time& stamp, std::string& reason) const {
  try {
    const tf2::Transform base_in_odom = transforms_.lookUp(stamp);
    reason.clear();
    return base_in_odom;
  } catch (const std::runtime_error& error) {  // tf2's, and those of sums of times
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
  requireUsableStamp(stamp);
  message.header.stamp = later(stamp, tolerance_s_);
  broadcaster_.sendTransform(message);
}

namespace {

constexpr unsigned kMessagesQueued = 10;

std_msgs::Header headerOf(const std::string& frame_id, const ros::Time& stamp) {
  std_msgs::Header header;
  header.frame_id = frame_id;
  header.stamp = stamp;
  return header;
}

/// -1 without a stamp. In 64 bits: differences of ros::Time throw beyond 68 years.
double latencyOf(const LocalizedImage& image) {
  if (!image.has_stamp) return -1.0;
  const auto now_ns = static_cast<std::int64_t>(ros::Time::now().toNSec());
  return static_cast<double>(now_ns - static_cast<std::int64_t>(image.header.stamp.toNSec())) * 1e-6;
}

}  // namespace

LocalizerPublisher::LocalizerPublisher(const ros::NodeHandle& node, ros::NodeHandle private_node,
                                       const NodeParameters& parameters, LocalizerDiagnostics& diagnostics,
                                       ThrottledLog& log)
    : config_(parameters.node),
      diagnostics_(diagnostics),
      log_(log),
      transform_(parameters, node, log),
      image_transport_(private_node) {
  constexpr bool kLatched = true;
  pose_ = private_node.advertise<geometry_msgs::PoseWithCovarianceStamped>("pose", kMessagesQueued);
  metric_pose_ = private_node.advertise<geometry_msgs::PoseWithCovarianceStamped>("metric_pose", kMessagesQueued);
  odometry_ = private_node.advertise<nav_msgs::Odometry>("odometry", kMessagesQueued);
  drive_markers_topic_ = private_node.advertise<visualization_msgs::MarkerArray>("drive_markers", kMessagesQueued);
  fix_ = private_node.advertise<sensor_msgs::NavSatFix>("fix", kMessagesQueued);
  path_ = private_node.advertise<nav_msgs::Path>("path", kMessagesQueued);
  camera_marker_ = private_node.advertise<visualization_msgs::Marker>("camera_marker", kMessagesQueued);
  particles_ = private_node.advertise<geometry_msgs::PoseArray>("particles", kMessagesQueued);
  particle_cloud_ = private_node.advertise<sensor_msgs::PointCloud2>("particle_cloud", kMessagesQueued);
  swarm_ = private_node.advertise<Swarm>("swarm", kMessagesQueued);
  status_ = private_node.advertise<LocalizationStatus>("status", kMessagesQueued);
  map_path_ = private_node.advertise<nav_msgs::Path>("map_path", 1, kLatched);
  map_markers_ = private_node.advertise<visualization_msgs::MarkerArray>("map_markers", 1, kLatched);
  matches_ = image_transport_.advertise("matches", 1);
  dashboard_image_ = image_transport_.advertise("dashboard", 1);
}

void LocalizerPublisher::publishMap(const TrainingMap& map) {
  transform_.forgetPose();
  const std::lock_guard<std::mutex> lock(shown_mutex_);
  map_path_message_ = toPath(map, config_.global_frame_id);
  map_markers_message_ = toMarkers(map, config_.global_frame_id);
  publishMap();
}

void LocalizerPublisher::publishMap() {
  map_path_.publish(map_path_message_);
  map_markers_.publish(map_markers_message_);
}

void LocalizerPublisher::publishState(LocalizationState state, const Why& why, const ImageCounts& counts) {
  Estimate nothing;
  nothing.state = state;
  nothing.why = why;
  publishStatus(toStatus(nothing, headerOf(config_.global_frame_id, ros::Time::now())), -1.0, counts);
  const std_msgs::Header header = headerOf(config_.global_frame_id, ros::Time::now());
  const std::lock_guard<std::mutex> lock(shown_mutex_);
  drive_markers_.stateIs(state, why);
  publishDriveMarkers(header);
  if (last_matches_.empty() || matches_.getNumSubscribers() == 0) return;
  const cv::Mat grey = greyedOut(std::exchange(last_matches_, {}), describe(why));
  matches_.publish(cv_bridge::CvImage(header, sensor_msgs::image_encodings::BGR8, grey).toImageMsg());
}

/// What the node alone knows comes in where nothing better is known.
Why LocalizerPublisher::whyOf(const Estimate& estimate, double latency_ms, const ImageCounts& counts) {
  constexpr double kAhead_ms = -1000.0;  // the clock of a played bag lags behind the stamps by a few milliseconds
  constexpr std::uint64_t kMany = 5;
  const std::uint64_t dropped = counts.dropped - std::exchange(dropped_, counts.dropped);
  if (estimate.why.reason != StateReason::kNotSureYet) return estimate.why;
  if (dropped >= kMany) return {StateReason::kImagesDropped, static_cast<double>(dropped)};
  if (latency_ms < kAhead_ms) return {StateReason::kClocksDiffer, -1e-3 * latency_ms};
  return estimate.why;
}

void LocalizerPublisher::publish(const LocalizedImage& image, const ImageCounts& counts) {
  const double latency_ms = latencyOf(image);
  Estimate estimate = image.result.estimate;
  estimate.why = whyOf(estimate, latency_ms, counts);
  const bool is_other_map = map_.lock() != image.result.map;
  if (is_other_map) {
    transform_.forgetPose();
    drive_.clear();
  }
  map_ = image.result.map;
  const std_msgs::Header header = headerOf(config_.global_frame_id, image.header.stamp);
  if (!estimate.frozen) {
    publishPose(estimate, header);
    publishDrive(image, header);
  }
  {
    const std::lock_guard<std::mutex> lock(shown_mutex_);
    if (is_other_map) drive_markers_.clear();
    drive_markers_.add(estimate);
    publishDriveMarkers(header);
  }
  publishParticles(image.result.particles, header);
  publishStatus(toStatus(estimate, header), latency_ms, counts);
  diagnostics_.imageProcessed(estimate, latency_ms);
  if (estimate.camera_contradicted) log_.warn("calibration", "Calibration wrong: " + estimate.cameraTrouble());
  publishTransform(estimate, image.header.stamp);
  publishMatches(image);
}

void LocalizerPublisher::publishPose(const Estimate& estimate, const std_msgs::Header& header) {
  pose_.publish(toPose(estimate, header));
  if (const auto metric_pose = toMetricPose(estimate, header)) {
    metric_pose_.publish(*metric_pose);
    odometry_.publish(toOdometry(*metric_pose, config_.base_frame_id));
  }
  fix_.publish(toFix(estimate, headerOf(config_.base_frame_id, header.stamp)));
}

void LocalizerPublisher::publishDrive(const LocalizedImage& image, const std_msgs::Header& header) {
  const Estimate& estimate = image.result.estimate;
  drive_.add(estimate, header);  // also without a subscriber: a later one sees the way so far
  if (path_.getNumSubscribers() > 0) path_.publish(drive_.toPath(header));
  if (camera_marker_.getNumSubscribers() > 0) {
    camera_marker_.publish(toCameraMarker(estimate, image.result.camera, header));
  }
}

/// rviz forgets everything then, and does not ask again for what is latched.
void LocalizerPublisher::timeWentBack() {
  transform_.forget();
  drive_.clear();
  const std::lock_guard<std::mutex> lock(shown_mutex_);
  drive_markers_.clear();
  publishMap();
}

/// The caller holds the mutex.
void LocalizerPublisher::publishDriveMarkers(const std_msgs::Header& header) {
  if (drive_markers_topic_.getNumSubscribers() > 0) drive_markers_topic_.publish(drive_markers_.toMarkers(header));
}

void LocalizerPublisher::publishTransform(const Estimate& estimate, const ros::Time& stamp) {
  if (estimate.frozen) return diagnostics_.transformMissing("the camera is frozen");  // the pose is an old one
  const std::string missing = transform_.publish(estimate, stamp);
  diagnostics_.transformMissing(missing);
  if (!missing.empty()) log_.warn("no transform", "No transform broadcast: " + missing);
}

void LocalizerPublisher::publishParticles(const std::vector<Particle>& all, const std_msgs::Header& header) {
  std::vector<Particle> particles;
  particles.reserve(all.size());
  std::copy_if(all.begin(), all.end(), std::back_inserter(particles),
               [](const Particle& particle) { return isFinite(particle); });
  if (particles_.getNumSubscribers() > 0) particles_.publish(toPoseArray(particles, header));
  if (particle_cloud_.getNumSubscribers() > 0) particle_cloud_.publish(toPointCloud(particles, header));
  if (swarm_.getNumSubscribers() > 0) swarm_.publish(toSwarm(particles, header));
}

void LocalizerPublisher::publishStatus(LocalizationStatus status, double latency_ms, const ImageCounts& counts) {
  status.latency_ms = latency_ms;
  status.images_processed = counts.processed;
  status.images_dropped = counts.dropped + counts.late;
  status.images_refused = counts.refused;
  status_.publish(status);
  publishDashboard(status);
}

void LocalizerPublisher::publishDashboard(const LocalizationStatus& status) {
  dashboard_.add(status);  // also without a subscriber: a later one sees the images before
  if (dashboard_image_.getNumSubscribers() == 0) return;
  const cv_bridge::CvImage image(status.header, sensor_msgs::image_encodings::BGR8, dashboard_.draw());
  dashboard_image_.publish(image.toImageMsg());
}

void LocalizerPublisher::publishMatches(const LocalizedImage& image) {
  if (matches_.getNumSubscribers() == 0) return;
  const SharedLocalizer::Result& result = image.result;
  const cv::Mat canvas =
      result.landmarks.landmarks.empty()
          ? drawMatches(image.grey, result.local, *result.map, result.estimate.tracked.best_image, result.match)
          : drawLandmarks(image.grey, result.landmarks, *result.map);
  const std::lock_guard<std::mutex> lock(shown_mutex_);
  last_matches_ = canvas;
  matches_.publish(cv_bridge::CvImage(image.header, sensor_msgs::image_encodings::BGR8, canvas).toImageMsg());
}

}  // namespace visual_localization
