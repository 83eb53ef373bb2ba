#pragma once

#include <vector>

#include <image_transport/image_transport.h>
#include <opencv2/core.hpp>
#include <ros/node_handle.h>
#include <ros/publisher.h>
#include <visual_localization/LocalizationStatus.h>

#include "node/dashboard.h"
#include "node/localizer_diagnostics.h"
#include "node/node_config.h"
#include "node/shared_localizer.h"

namespace visual_localization {

/// All topics that the node publishes under its own name.
class LocalizerPublisher {
 public:
  LocalizerPublisher(ros::NodeHandle private_node, const NodeConfig& config);

  void publishMap(const TrainingMap& map);
  /// What is known without an image: that there is no map, or that none comes. Stamped with the present.
  void publishState(LocalizationState state, const ImageCounts& counts);
  /// Everything that is known after an image but the drawing: no pose after one of a frozen camera. `result` must be
  /// finite.
  void publish(const SharedLocalizer::Result& result, const ros::Time& stamp, double latency_ms,
               const ImageCounts& counts);
  /// Draws and publishes the matches with the best training image if somebody looks.
  void publishMatches(const SharedLocalizer::Result& result, const cv::Mat& grey, const std_msgs::Header& header);

 private:
  void publishParticles(const std::vector<Particle>& particles, const std_msgs::Header& header);
  void publishStatus(LocalizationStatus status, double latency_ms, const ImageCounts& counts);
  void publishDashboard(const LocalizationStatus& status);

  const NodeConfig config_;
  image_transport::ImageTransport image_transport_;
  ros::Publisher pose_;
  ros::Publisher fix_;
  ros::Publisher particles_;
  ros::Publisher particle_cloud_;
  ros::Publisher swarm_;
  ros::Publisher status_;
  ros::Publisher map_path_;
  ros::Publisher map_markers_;
  image_transport::Publisher matches_;
  Dashboard dashboard_;
  image_transport::Publisher dashboard_image_;
};

}  // namespace visual_localization
