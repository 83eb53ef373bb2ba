#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include <image_transport/image_transport.h>
#include <ros/callback_queue.h>
#include <ros/node_handle.h>
#include <ros/publisher.h>
#include <ros/spinner.h>
#include <ros/steady_timer.h>
#include <ros/time.h>
#include <tf2/LinearMath/Transform.h>
#include <tf2_ros/transform_broadcaster.h>
#include <visual_localization/LocalizationStatus.h>

#include "node/drawings.h"
#include "node/drive_markers.h"
#include "node/image_worker.h"
#include "node/late_odometry.h"
#include "node/localizer_diagnostics.h"
#include "node/markers.h"
#include "node/node_config.h"
#include "node/robot_transforms.h"
#include "node/throttled_log.h"
#include "visual_localization/localization/estimate.h"
#include "visual_localization/localization/odometry.h"

namespace visual_localization {

tf2::Transform odomInMap(const tf2::Transform& base_in_map, const tf2::Transform& base_in_odom);

/// `metric_only`: where landmarks can verify poses, a verified one alone may.
bool movesRobot(const Estimate& estimate, bool metric_only);

/// odom_in_map between images. A correction within three standard deviations of pose and odometry slides in; a larger
/// one means that the robot is elsewhere, and moves it at once.
class SlidingCorrection {
 public:
  /// `smoothing_s`: time constant; 0: at once.
  SlidingCorrection(double smoothing_s, const OdometryConfig& odometry)
      : smoothing_s_(smoothing_s), odometry_(odometry) {}

  void configure(const OdometryConfig& odometry) { odometry_ = odometry; }
  /// Standard deviations of the pose, of each axis and of the heading.
  void aimAt(const tf2::Transform& odom_in_map, const tf2::Transform& base_in_odom, double sigma_m,
             double sigma_yaw_rad);
  /// `elapsed_s` after the last call, with the robot at `base_in_odom`. To be called after aimAt().
  tf2::Transform after(double elapsed_s, const tf2::Transform& base_in_odom);

 private:
  double smoothing_s_;
  OdometryConfig odometry_;
  tf2::Transform target_ = tf2::Transform::getIdentity();
  std::optional<tf2::Transform> shown_;
  std::optional<tf2::Transform> base_in_odom_;  ///< at the last call
  double way_m_ = 0.0;                          ///< by odometry, since the last aim
};

/// Broadcasts the estimate as NodeConfig::tf_mode says: with each image, or with map_to_odom at NodeConfig::tf_rate,
/// from a thread of its own. A pose moves the robot when odometry of its time has come. Until then, and after an
/// estimate that may not move the robot, the last transform goes on.
class TransformPublisher {
 public:
  /// `log` must outlive it.
  TransformPublisher(const NodeParameters& parameters, const ros::NodeHandle& node, ThrottledLog& log);
  ~TransformPublisher();

  /// Tolerance, timeout and drift of odometry. From any thread.
  void configure(const NodeParameters& parameters);
  /// Time has gone back: the odometry in the buffer lies in the future.
  void forget();
  /// Another map. From any thread.
  void forgetPose();
  /// Returns why nothing is broadcast; empty when something is, or should not be.
  std::string publish(const Estimate& estimate, const ros::Time& stamp);

 private:
  /// The caller holds the mutex, as for the next two.
  std::string move(const PoseEstimate& pose, const ros::Time& stamp);
  bool moveByOdometry();
  std::string hold(const ros::Time& stamp);
  void odometryCame();
  /// `stamp` 0: the newest. `reason`: why there is none, otherwise empty.
  std::optional<tf2::Transform> lookUpBaseInOdom(const ros::Time& stamp, std::string& reason) const;
  void broadcastBetween(const ros::Time& now);
  void broadcast(const tf2::Transform& child_in_map, const std::string& child, const ros::Time& stamp);

  const NodeConfig config_;
  ThrottledLog& log_;
  const bool between_images_;  ///< instead of with them
  std::atomic<double> tolerance_s_;
  std::atomic<double> image_timeout_s_;
  RobotTransforms transforms_;
  std::optional<RobotTransformListener> listener_;  ///< only with odometry
  tf2_ros::TransformBroadcaster broadcaster_;
  ros::Time last_stamp_;
  std::string last_reason_;  ///< why nothing was broadcast for that stamp
  std::mutex mutex_;         ///< of all that follows, until the next comment
  OdometryConfig odometry_;
  LateOdometry late_;
  std::optional<tf2::Transform> odom_in_map_;         ///< of the last estimate that moved the robot
  SlidingCorrection correction_;                      ///< where that is known
  ros::Time last_between_;                            ///< broadcast
  std::chrono::steady_clock::time_point last_image_;  ///< that was no frozen camera's
  std::string trouble_between_;
  ros::CallbackQueue queue_;
  ros::SteadyTimer timer_;
  std::unique_ptr<ros::AsyncSpinner> spinner_;  ///< nothing that waits for an image may hold it up
};

/// Everything that the node says about an image: topics under its own name, transform, diagnostics.
class LocalizerPublisher : public ImageOutput {
 public:
  /// `diagnostics` and `log` must outlive it.
  LocalizerPublisher(const ros::NodeHandle& node, ros::NodeHandle private_node, const NodeParameters& parameters,
                     LocalizerDiagnostics& diagnostics, ThrottledLog& log);

  void publishMap(const TrainingMap& map);
  /// Without an image; stamped with the present. A silent camera's last matches turn grey.
  void publishState(LocalizationState state, const Why& why, const ImageCounts& counts);
  /// From any thread.
  void configure(const NodeParameters& parameters) { transform_.configure(parameters); }

  /// No pose and no transform after an image of a frozen camera.
  void publish(const LocalizedImage& image, const ImageCounts& counts) override;
  void refused(const std::string& reason) override { diagnostics_.imageRefused(reason); }
  void timeWentBack() override;

 private:
  void publishPose(const Estimate& estimate, const std_msgs::Header& header);
  void publishMap();
  void publishDriveMarkers(const std_msgs::Header& header);
  void publishDrive(const LocalizedImage& image, const std_msgs::Header& header);
  void publishTransform(const Estimate& estimate, const ros::Time& stamp);
  void publishParticles(const std::vector<Particle>& particles, const std_msgs::Header& header);
  void publishStatus(LocalizationStatus status, double latency_ms, const ImageCounts& counts);
  void publishDashboard(const LocalizationStatus& status);
  void publishMatches(const LocalizedImage& image);
  Why whyOf(const Estimate& estimate, double latency_ms, const ImageCounts& counts);

  const NodeConfig config_;
  LocalizerDiagnostics& diagnostics_;
  ThrottledLog& log_;
  TransformPublisher transform_;
  std::weak_ptr<const TrainingMap> map_;  ///< of the last image
  DrivenPath drive_;
  std::uint64_t dropped_ = 0;  ///< images, until the last one
  image_transport::ImageTransport image_transport_;
  ros::Publisher pose_;
  ros::Publisher metric_pose_;
  ros::Publisher fix_;
  ros::Publisher path_;
  ros::Publisher camera_marker_;
  ros::Publisher drive_markers_topic_;
  ros::Publisher odometry_;
  ros::Publisher particles_;
  ros::Publisher particle_cloud_;
  ros::Publisher swarm_;
  ros::Publisher status_;
  ros::Publisher map_path_;
  ros::Publisher map_markers_;
  image_transport::Publisher matches_;
  std::mutex
      shown_mutex_;       ///< of all that follows, until the next comment: images and silence have threads of their own
  cv::Mat last_matches_;  ///< as published; empty once they are grey
  DriveMarkers drive_markers_;
  nav_msgs::Path map_path_message_;
  visualization_msgs::MarkerArray map_markers_message_;
  // Thread-safe, as publishers are.
  Dashboard dashboard_;
  image_transport::Publisher dashboard_image_;
};

}  // namespace visual_localization
