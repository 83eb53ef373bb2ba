#include "node/localizer_publisher.h"

#include <algorithm>
#include <cstdint>
#include <iterator>

#include <cv_bridge/cv_bridge.h>
#include <sensor_msgs/image_encodings.h>

#include "node/matches_image.h"
#include "node/message_conversions.h"
#include "node/rviz_messages.h"

namespace visual_localization {
namespace {

constexpr unsigned kMessagesQueued = 10;

std_msgs::Header headerOf(const std::string& frame_id, const ros::Time& stamp) {
  std_msgs::Header header;
  header.frame_id = frame_id;
  header.stamp = stamp;
  return header;
}

/// -1 for an image without a stamp. In 64 bits: differences of ros::Time throw when they are longer than 68 years.
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
      transform_(parameters, node),
      image_transport_(private_node) {
  constexpr bool kLatched = true;
  pose_ = private_node.advertise<geometry_msgs::PoseWithCovarianceStamped>("pose", kMessagesQueued);
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
  map_path_.publish(toPath(map, config_.global_frame_id));
  map_markers_.publish(toMarkers(map, config_.global_frame_id));
}

void LocalizerPublisher::publishState(LocalizationState state, const ImageCounts& counts) {
  Estimate nothing;
  nothing.state = state;
  publishStatus(toStatus(nothing, headerOf(config_.global_frame_id, ros::Time::now())), -1.0, counts);
}

void LocalizerPublisher::publish(const LocalizedImage& image, const ImageCounts& counts) {
  const double latency_ms = latencyOf(image);
  const Estimate& estimate = image.result.estimate;
  if (map_.lock() != image.result.map) {
    transform_.forgetPose();
    drive_.clear();
  }
  map_ = image.result.map;
  const std_msgs::Header header = headerOf(config_.global_frame_id, image.header.stamp);
  if (!estimate.frozen) {
    publishPose(estimate, header);
    publishDrive(image, header);
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

void LocalizerPublisher::timeWentBack() {
  transform_.forget();
  drive_.clear();
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
          ? drawMatches(image.grey, result.sift, *result.map, result.estimate.tracked.best_image, result.match)
          : drawLandmarks(image.grey, result.landmarks, *result.map);
  matches_.publish(cv_bridge::CvImage(image.header, sensor_msgs::image_encodings::BGR8, canvas).toImageMsg());
}

}  // namespace visual_localization
