#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include <geometry_msgs/PoseWithCovarianceStamped.h>
#include <nav_msgs/Odometry.h>
#include <nodelet/nodelet.h>
#include <ros/callback_queue.h>
#include <ros/service_server.h>
#include <ros/spinner.h>
#include <ros/subscriber.h>
#include <ros/wall_timer.h>
#include <std_srvs/Empty.h>
#include <visual_localization/FromLL.h>
#include <visual_localization/LoadMap.h>
#include <visual_localization/Relocalize.h>
#include <visual_localization/ToLL.h>

#include "node/camera_watch.h"
#include "node/image_worker.h"
#include "node/localizer_diagnostics.h"
#include "node/localizer_publisher.h"
#include "node/node_config.h"
#include "node/reconfigure_server.h"
#include "node/session_recorder.h"
#include "node/shared_localizer.h"
#include "node/throttled_log.h"

namespace visual_localization {

/// Images in, poses out: parameters, callbacks and services around an ImageWorker. An invalid parameter stops the
/// start.
class LocalizerNodelet : public nodelet::Nodelet {
 public:
  LocalizerNodelet();
  ~LocalizerNodelet() override;

 private:
  void onInit() override;
  void start();
  void stop();
  void useFirstMap();
  void offerServices();

  void onInitialPose(const geometry_msgs::PoseWithCovarianceStampedConstPtr& pose);
  void onOdometry(const nav_msgs::OdometryConstPtr& odometry);
  bool onRelocalize(Relocalize::Request& request, Relocalize::Response& response);
  bool onGlobalLocalization(std_srvs::Empty::Request& request, std_srvs::Empty::Response& response);
  bool onLoadMap(LoadMap::Request& request, LoadMap::Response& response);
  bool onFromLL(FromLL::Request& request, FromLL::Response& response);
  bool onToLL(ToLL::Request& request, ToLL::Response& response);
  void configure(const NodeParameters& parameters, const ParameterValues& changed);
  void onTimer(const ros::WallTimerEvent& event);

  void watchCamera();
  /// Throws MapStoreError and leaves everything as it is when there is no map at `path`.
  std::size_t useMap(const std::string& path);

  NodeParameters parameters_;  ///< at the start; what can change lives where it is used
  ThrottledLog log_;
  std::unique_ptr<SharedLocalizer> localizer_;
  std::unique_ptr<LocalizerDiagnostics> diagnostics_;
  std::unique_ptr<LocalizerPublisher> publisher_;
  std::unique_ptr<UsageRecorder> usage_;  ///< only where it is asked for
  std::unique_ptr<SessionRecorder> sessions_;
  std::unique_ptr<ImageWorker> worker_;
  std::unique_ptr<ImageSource> images_;
  std::unique_ptr<CameraWatch> camera_;
  ros::Subscriber initial_pose_;
  ros::Subscriber odometry_;
  ros::CallbackQueue service_queue_;
  std::vector<ros::ServiceServer> services_;
  std::unique_ptr<ReconfigureServer> reconfigure_;
  std::unique_ptr<ros::AsyncSpinner> service_spinner_;
  ros::WallTimer timer_;
  bool camera_silent_ = false;  ///< as the timer last saw it
};

}  // namespace visual_localization
