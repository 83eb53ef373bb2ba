#pragma once

#include <atomic>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <image_transport/image_transport.h>
#include <ros/node_handle.h>
#include <ros/publisher.h>
#include <ros/time.h>
#include <tf2/LinearMath/Transform.h>
#include <tf2_ros/buffer.h>
#include <tf2_ros/transform_broadcaster.h>
#include <tf2_ros/transform_listener.h>
#include <visual_localization/LocalizationStatus.h>

#include "node/dashboard.h"
#include "node/image_worker.h"
#include "node/localizer_diagnostics.h"
#include "node/node_config.h"
#include "node/rviz_messages.h"
#include "node/throttled_log.h"
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

/// Everything that the node says about an image: topics under its own name, transform, diagnostics.
class LocalizerPublisher : public ImageOutput {
 public:
  /// `diagnostics` and `log` must outlive it.
  LocalizerPublisher(const ros::NodeHandle& node, ros::NodeHandle private_node, const NodeConfig& config,
                     LocalizerDiagnostics& diagnostics, ThrottledLog& log);

  void publishMap(const TrainingMap& map);
  /// What is known without an image: that there is no map, or that no image comes. Stamped with the present.
  void publishState(LocalizationState state, const ImageCounts& counts);
  void setTransformTolerance(double transform_tolerance_s) { transform_.setTolerance(transform_tolerance_s); }

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
