#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include <diagnostic_updater/diagnostic_updater.h>
#include <opencv2/core.hpp>
#include <ros/callback_queue.h>
#include <ros/node_handle.h>
#include <ros/spinner.h>

#include "node/image_worker.h"
#include "node/localizer_diagnostics.h"
#include "node/published_topics.h"
#include "node/recording_watch.h"
#include "node/session_bag.h"
#include "node/throttled_log.h"
#include "ros/message_readers.h"
#include "ros/static_transforms.h"
#include "visual_localization/WriteMap.h"
#include "visual_localization/features/front_end.h"
#include "visual_localization/features/local_features.h"
#include "visual_localization/map/map_builder.h"
#include "visual_localization/parameters/parameters.h"

namespace visual_localization {

/// Parameters of the recorder.
struct RecorderConfig {
  std::string folder;
  std::string map;
  std::string image_transport = "raw";
  std::string builder_config;
  double sync_period_s = 5.0;
  std::string global_frame_id = "map";
  WatchConfig watch;

  void declare(ParameterVisitor& visitor);
};

/// What a map is built from.
struct RecordedSession {
  std::string bag;
  std::string image_topic;  ///< without the transport's suffix
  std::string fix_topic;
  std::string map;     ///< that is extended; empty: none
  std::string config;  ///< of the map builder; empty: its defaults
  std::string output;
};

/// Records images, camera_info, fixes, odometry and static transforms into a bag that is whole at any moment. Says what
/// will be weak, on /diagnostics and in rviz, and writes the map when asked to.
class MapRecorder {
 public:
  /// In a process of its own, so that the recording goes on; throws std::exception in one line.
  using BuildMap = std::function<void(const RecordedSession& session)>;

  /// Begins to record. Throws ParameterError, FileError or MapStoreError.
  MapRecorder(const ros::NodeHandle& node, const ros::NodeHandle& private_node, BuildMap build_map);
  ~MapRecorder();
  MapRecorder(const MapRecorder&) = delete;
  MapRecorder& operator=(const MapRecorder&) = delete;

 private:
  using Wrapper = diagnostic_updater::DiagnosticStatusWrapper;
  template <class Message>
  using Look = std::function<void(const boost::shared_ptr<const Message>& message)>;

  template <class Message>
  void record(const std::string& name, std::uint32_t queue, Look<Message> look = {});
  template <class Message>
  void recordImages(const std::string& topic);
  void watchCalibration(const sensor_msgs::CameraInfo& info);
  void sync();
  void syncSometimes();
  void reportDisk();
  void lookAtImages();
  std::string mountTrouble() const;
  std::size_t featuresOf(const cv::Mat& grey);
  bool onWriteMap(WriteMap::Request& request, WriteMap::Response& response);
  RecordedSession sessionFor(const std::string& path) const;
  void onTimer(const ros::WallTimerEvent& event);
  void publishWay();
  void reportRecordingTo(Wrapper& status);
  void reportSessionTo(Wrapper& status);

  ros::NodeHandle node_;
  ros::NodeHandle private_node_;
  BuildMap build_map_;
  RecorderConfig config_;
  ThrottledLog log_;
  std::mutex mutex_;  ///< of all that follows, until the next comment
  std::optional<SessionBag> bag_;
  std::optional<RecordingWatch> watch_;
  RateMeter images_;
  std::string image_trouble_;
  SingleCalibration calibration_{false};
  std::string calibration_trouble_;  ///< that no later message mends
  PublishedTopics topics_;
  StaticTransforms transforms_;
  std::optional<std::string> image_frame_;
  std::optional<std::string> fix_frame_;
  std::size_t published_ = 0;
  // What has its own lock, or does not change.
  std::unique_ptr<LocalExtractor> extractor_;
  LatestQueue<ReceivedImage> queue_;
  std::thread looker_;
  std::vector<ros::Subscriber> subscribers_;
  std::string image_topic_;
  std::string recorded_topic_;  ///< with the suffix of its transport
  std::string image_type_;
  std::string fix_topic_;
  MapBuilderConfig builder_;
  ros::Publisher way_;
  ros::CallbackQueue services_;
  ros::ServiceServer write_map_;
  diagnostic_updater::Updater updater_;
  ros::WallTimer timer_;
  ros::WallTimer sync_timer_;
  std::optional<ros::AsyncSpinner> service_spinner_;  ///< a map takes minutes, and images must not wait for it
};

}  // namespace visual_localization
