#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <image_transport/image_transport.h>
#include <ros/node_handle.h>
#include <ros/publisher.h>
#include <ros/time.h>
#include <visual_localization/LocalizationStatus.h>

#include "node/dashboard.h"
#include "node/image_worker.h"
#include "node/localizer_diagnostics.h"
#include "node/node_config.h"
#include "node/rviz_messages.h"
#include "node/throttled_log.h"
#include "node/transform_publisher.h"
#include "visual_localization/localization/estimate.h"

namespace visual_localization {

/// Everything that the node says about an image: topics under its own name, transform, diagnostics.
class LocalizerPublisher : public ImageOutput {
 public:
  /// `diagnostics` and `log` must outlive it.
  LocalizerPublisher(const ros::NodeHandle& node, ros::NodeHandle private_node, const NodeParameters& parameters,
                     LocalizerDiagnostics& diagnostics, ThrottledLog& log);

  void publishMap(const TrainingMap& map);
  /// What is known without an image: that there is no map, or that no image comes. Stamped with the present.
  void publishState(LocalizationState state, const ImageCounts& counts);
  /// What can change while it runs. From any thread.
  void configure(const NodeParameters& parameters) { transform_.configure(parameters); }

  /// No pose and no transform after an image of a frozen camera.
  void publish(const LocalizedImage& image, const ImageCounts& counts) override;
  void refused(const std::string& reason) override { diagnostics_.imageRefused(reason); }
  void timeWentBack() override;

 private:
  void publishPose(const Estimate& estimate, const std_msgs::Header& header);
  void publishDrive(const LocalizedImage& image, const std_msgs::Header& header);
  void publishTransform(const Estimate& estimate, const ros::Time& stamp);
  void publishParticles(const std::vector<Particle>& particles, const std_msgs::Header& header);
  void publishStatus(LocalizationStatus status, double latency_ms, const ImageCounts& counts);
  void publishDashboard(const LocalizationStatus& status);
  void publishMatches(const LocalizedImage& image);

  const NodeConfig config_;
  LocalizerDiagnostics& diagnostics_;
  ThrottledLog& log_;
  TransformPublisher transform_;
  std::weak_ptr<const TrainingMap> map_;  ///< of the last image
  DrivenPath drive_;
  image_transport::ImageTransport image_transport_;
  ros::Publisher pose_;
  ros::Publisher fix_;
  ros::Publisher path_;
  ros::Publisher camera_marker_;
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
