#include "node/localizer_publisher.h"

#include <algorithm>
#include <iterator>

#include <cv_bridge/cv_bridge.h>
#include <sensor_msgs/image_encodings.h>

#include "node/matches_image.h"
#include "node/message_conversions.h"

namespace visual_localization {
namespace {

constexpr unsigned kQueue = 10;

std_msgs::Header headerOf(const std::string& frame_id, const ros::Time& stamp) {
  std_msgs::Header header;
  header.frame_id = frame_id;
  header.stamp = stamp;
  return header;
}

}  // namespace

LocalizerPublisher::LocalizerPublisher(ros::NodeHandle node, const NodeConfig& config)
    : config_(config), image_transport_(node) {
  constexpr bool kLatched = true;
  pose_ = node.advertise<geometry_msgs::PoseWithCovarianceStamped>("pose", kQueue);
  fix_ = node.advertise<sensor_msgs::NavSatFix>("fix", kQueue);
  particles_ = node.advertise<geometry_msgs::PoseArray>("particles", kQueue);
  particle_cloud_ = node.advertise<sensor_msgs::PointCloud2>("particle_cloud", kQueue);
  swarm_ = node.advertise<Swarm>("swarm", kQueue);
  status_ = node.advertise<LocalizationStatus>("status", kQueue);
  map_path_ = node.advertise<nav_msgs::Path>("map_path", 1, kLatched);
  map_markers_ = node.advertise<visualization_msgs::MarkerArray>("map_markers", 1, kLatched);
  matches_ = image_transport_.advertise("matches", 1);
  dashboard_image_ = image_transport_.advertise("dashboard", 1);
}

void LocalizerPublisher::publishMap(const TrainingMap& map) {
  map_path_.publish(toPath(map, config_.global_frame_id));
  map_markers_.publish(toMarkers(map, config_.global_frame_id));
}

void LocalizerPublisher::publishState(LocalizationState state, const ImageCounts& counts) {
  Estimate nothing;
  nothing.state = state;
  publishStatus(toStatus(nothing, headerOf(config_.global_frame_id, ros::Time::now())), -1.0, counts);
}

void LocalizerPublisher::publish(const SharedLocalizer::Result& result, const ros::Time& stamp, double latency_ms,
                                 const ImageCounts& counts) {
  const std_msgs::Header header = headerOf(config_.global_frame_id, stamp);
  if (!result.estimate.frozen) {
    pose_.publish(toPose(result.estimate, header));
    fix_.publish(toFix(result.estimate, headerOf(config_.base_frame_id, stamp)));
  }
  publishParticles(result.particles, header);
  publishStatus(toStatus(result.estimate, header), latency_ms, counts);
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
  dashboard_.add(status);  // also while nobody looks, so that who comes later sees what was before
  if (dashboard_image_.getNumSubscribers() == 0) return;
  const cv_bridge::CvImage image(status.header, sensor_msgs::image_encodings::BGR8, dashboard_.draw());
  dashboard_image_.publish(image.toImageMsg());
}

void LocalizerPublisher::publishMatches(const SharedLocalizer::Result& result, const cv::Mat& grey,
                                        const std_msgs::Header& header) {
  if (matches_.getNumSubscribers() == 0) return;
  const cv::Mat canvas =
      drawMatches(grey, result.sift, *result.map, result.estimate.tracked.best_image, result.match);
  matches_.publish(cv_bridge::CvImage(header, sensor_msgs::image_encodings::BGR8, canvas).toImageMsg());
}

}  // namespace visual_localization
