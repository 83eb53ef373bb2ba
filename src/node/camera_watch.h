#pragma once

#include <functional>
#include <mutex>
#include <optional>
#include <string>

#include <ros/node_handle.h>
#include <ros/subscriber.h>
#include <sensor_msgs/CameraInfo.h>

#include "node/localizer_diagnostics.h"
#include "node/node_config.h"
#include "node/shared_localizer.h"
#include "ros/message_readers.h"
#include "visual_localization/camera/camera_model.h"
#include "visual_localization/geometry/camera_pose.h"
#include "visual_localization/map/training_map.h"

namespace visual_localization {

/// Keeps the localizer informed about the camera: calibration (from a file or the topic beside the images), mask, and
/// mounting (from a parameter, /tf_static or what never changes in /tf). Says once each what it uses. What cannot be
/// used changes nothing.
class CameraWatch {
 public:
  /// `warning`: it needs attention.
  using Say = std::function<void(bool warning, const std::string& text)>;

  /// Without a file of calibration subscribes to the topic beside `image_topic`. Throws ParameterError, naming the
  /// parameter, when a file cannot be used. The others must outlive it.
  CameraWatch(ros::NodeHandle node, const NodeConfig& config, const std::string& image_topic,
              SharedLocalizer& localizer, LocalizerDiagnostics& diagnostics, Say say);
  ~CameraWatch() {
    subscriber_.shutdown();
    static_transforms_.shutdown();
    transforms_subscriber_.shutdown();
  }
  CameraWatch(const CameraWatch&) = delete;
  CameraWatch& operator=(const CameraWatch&) = delete;

  void mapIs(const MapHeader& map);
  void imageFrameIs(const std::string& frame);

 private:
  void onCameraInfo(const sensor_msgs::CameraInfoConstPtr& info);
  void onStaticTransforms(const tf2_msgs::TFMessageConstPtr& message);
  void onTransforms(const tf2_msgs::TFMessageConstPtr& message);
  void findMount();
  void sayMountTrouble();
  void use(const CameraModel& camera, const std::string& source);
  void refuse(const std::string& reason);
  void compareWithMap();
  void report();

  SharedLocalizer& localizer_;
  LocalizerDiagnostics& diagnostics_;
  Say say_;
  std::string topic_;  ///< beside the images
  bool rectified_;
  std::mutex mutex_;  ///< images and services have threads of their own
  sensor_msgs::CameraInfoConstPtr last_;
  std::optional<CameraModel> camera_;
  std::optional<CameraModel> of_map_;
  cv::Size map_size_;
  std::string source_;
  std::string trouble_;
  std::string said_;  ///< about the difference from the map's camera
  std::string base_frame_;
  std::optional<std::string> camera_frame_;  ///< once an image has come
  StaticTransforms transforms_;
  std::optional<SensorMount> mount_;
  std::string mount_trouble_;  ///< why there is none, or why it is not believed
  std::string mount_said_;     ///< what was said of that
  ros::WallTime trouble_since_;
  ros::Subscriber subscriber_;
  ros::Subscriber static_transforms_;
  ros::Subscriber transforms_subscriber_;
};

}  // namespace visual_localization
