#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include <geometry_msgs/PoseWithCovarianceStamped.h>
#include <nodelet/nodelet.h>
#include <ros/callback_queue.h>
#include <ros/service_server.h>
#include <ros/spinner.h>
#include <ros/subscriber.h>
#include <ros/wall_timer.h>
#include <std_srvs/Empty.h>
#include <visual_localization/LoadMap.h>
#include <visual_localization/Relocalize.h>

#include "node/image_source.h"
#include "node/image_worker.h"
#include "node/localizer_diagnostics.h"
#include "node/localizer_publisher.h"
#include "node/node_config.h"
#include "node/reconfigure_server.h"
#include "node/shared_localizer.h"
#include "node/throttle.h"
#include "node/transform_publisher.h"

namespace visual_localization {

/// Images in, poses out. The callbacks of roscpp only put images into a queue of one; one thread of its own
/// works on the newest. A parameter that is not allowed stops the start.
class LocalizerNodelet : public nodelet::Nodelet {
 public:
  LocalizerNodelet() = default;
  ~LocalizerNodelet() override;

 private:
  void onInit() override;
  void start();
  void stop();
  void offerServices();

  void onImage(ReceivedImage image);
  void onInitialPose(const geometry_msgs::PoseWithCovarianceStampedConstPtr& pose);
  bool onRelocalize(Relocalize::Request& request, Relocalize::Response& response);
  bool onGlobalLocalization(std_srvs::Empty::Request& request, std_srvs::Empty::Response& response);
  bool onLoadMap(LoadMap::Request& request, LoadMap::Response& response);
  void configure(const NodeParameters& parameters, const ParameterValues& changed);
  void onTimer(const ros::WallTimerEvent& event);

  /// Throws MapStoreError and leaves everything as it is when there is no map at `path`.
  std::size_t useMap(const std::string& path);
  void work();
  void process(const ReceivedImage& image);
  /// False for an image that comes too late to be of use.
  bool isInOrder(const ros::Time& stamp);
  void watchCamera();
  void reportTrouble(const Estimate& estimate);
  void publish(const SharedLocalizer::Result& result, const ros::Time& stamp, bool stamp_is_usable);
  ros::Time usableStamp(const ros::Time& stamp);
  void refuse(const std::string& reason);
  ImageCounts counts() const;

  NodeParameters parameters_;  ///< at the start; what can change lives where it is used
  std::unique_ptr<SharedLocalizer> localizer_;
  std::unique_ptr<LocalizerPublisher> publisher_;
  std::unique_ptr<TransformPublisher> transform_publisher_;
  std::unique_ptr<LocalizerDiagnostics> diagnostics_;
  std::unique_ptr<ImageSource> images_;
  ros::Subscriber initial_pose_;
  ros::CallbackQueue service_queue_;
  std::vector<ros::ServiceServer> services_;
  std::unique_ptr<ReconfigureServer> reconfigure_;
  std::unique_ptr<ros::AsyncSpinner> service_spinner_;
  ros::WallTimer timer_;

  LatestQueue<ReceivedImage> queue_;
  std::atomic<std::uint64_t> processed_{0};
  std::atomic<std::uint64_t> late_{0};
  std::atomic<std::uint64_t> refused_{0};
  StampMonitor stamps_;         ///< of the worker
  bool camera_silent_ = false;  ///< of the timer
  Throttle refusal_throttle_;
  Throttle initial_pose_throttle_;
  Throttle stamp_throttle_;
  Throttle transform_throttle_;
  Throttle finite_throttle_;
  Throttle order_throttle_;
  Throttle jump_throttle_;
  Throttle trouble_throttle_;
  std::thread worker_;
};

}  // namespace visual_localization
