#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include <Eigen/Core>
#include <diagnostic_updater/diagnostic_updater.h>
#include <opencv2/core.hpp>
#include <ros/callback_queue.h>
#include <ros/node_handle.h>
#include <ros/spinner.h>

#include "bag/bag_writer.h"
#include "node/image_worker.h"
#include "node/localizer_diagnostics.h"
#include "node/published_topics.h"
#include "node/throttled_log.h"
#include "ros/message_readers.h"
#include "ros/static_transforms.h"
#include "visual_localization/WriteMap.h"
#include "visual_localization/features/front_end.h"
#include "visual_localization/features/local_features.h"
#include "visual_localization/geo/trajectory.h"
#include "visual_localization/map/map_builder.h"
#include "visual_localization/map/training_map.h"
#include "visual_localization/parameters/parameters.h"

namespace visual_localization {

/// What counts as weak.
struct WatchConfig {
  double max_spacing_m = 2.0;
  double max_fix_sigma_m = 3.0;
  double max_fix_age_s = 2.0;
  int few_features = 50;

  void declare(ParameterVisitor& visitor);
};

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

/// What a map will lack where an image was recorded; the first that holds.
enum class Weakness : std::uint8_t {
  kNone,
  kNoFix,
  kPoorFix,      ///< the receiver itself doubts its fixes
  kFewFeatures,  ///< too dark, too bright, blurred, or nothing to see
  kFarApart,     ///< too fast for the rate of the camera
};
constexpr std::size_t kWeaknesses = 5;
const char* describe(Weakness weakness);

/// Looks at a session while it is recorded and says what will be weak in its map, as long as the robot is still there.
class RecordingWatch {
 public:
  /// An image that was looked at, where the last usable fix was.
  struct Spot {
    Eigen::Vector2d position_m =
        Eigen::Vector2d::Zero();  ///< east, north in the map's frame, or about the first usable fix
    Weakness weakness = Weakness::kNone;
  };
  /// What is known so far.
  struct Summary {
    std::size_t images = 0;                          ///< that were looked at
    std::array<std::size_t, kWeaknesses> weak = {};  ///< images by weakness
    Weakness now = Weakness::kNone;                  ///< of the last image
    std::size_t fixes = 0;
    std::size_t usable_fixes = 0;
    double fix_sigma_m = 0.0;      ///< of the last usable one; 0: the receiver does not say
    double way_m = 0.0;            ///< driven, in steps of 3 m
    double spacing_m = 0.0;        ///< of the last images
    std::size_t features = 0;      ///< of the last image
    double known_way_share = 0.0;  ///< of the images: within 2 m of a session of the map that was recorded within 2 h
                                   ///< of this time of day, so that they add little
  };

  /// `map`: the one that the session will be added to; null: none.
  RecordingWatch(const WatchConfig& config, std::shared_ptr<const TrainingMap> map);

  void addFix(const Fix& fix);
  void addImage(std::int64_t stamp_ns);
  /// A slow computer does not look at all images.
  void addLook(std::int64_t stamp_ns, std::size_t features);

  Summary summary() const { return summary_; }
  /// Since the first usable fix, in their order.
  const std::vector<Spot>& spots() const { return spots_; }

 private:
  bool hasPositionAt(std::int64_t stamp_ns) const;
  Weakness weaknessOf(std::int64_t stamp_ns, std::size_t features) const;
  bool isKnown(std::int64_t stamp_ns) const;
  void addWay();

  WatchConfig config_;
  std::shared_ptr<const TrainingMap> map_;
  std::optional<LocalFrame> frame_;  ///< of the spots
  std::optional<Fix> last_fix_;      ///< usable
  Eigen::Vector2d position_m_ = Eigen::Vector2d::Zero();
  std::deque<Eigen::Vector2d> last_images_;
  std::optional<Eigen::Vector2d> way_from_m_;
  std::size_t placed_ = 0;  ///< images that were looked at and have a position
  std::size_t known_ = 0;   ///< of these
  std::vector<Spot> spots_;
  Summary summary_;
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
  void sync(bool at_once);
  void syncBag();
  template <class Message>
  void write(const std::string& topic, const Message& message);
  void lookAtImages();
  std::string mountTrouble() const;
  std::size_t featuresOf(const cv::Mat& grey);
  bool onWriteMap(WriteMap::Request& request, WriteMap::Response& response);
  RecordedSession sessionFor(const std::string& path) const;
  void onTimer(const ros::WallTimerEvent& event);
  void publishWay();
  void reportRecording(Wrapper& status);
  void reportSession(Wrapper& status);

  ros::NodeHandle node_;
  ros::NodeHandle private_node_;
  BuildMap build_map_;
  RecorderConfig config_;
  ThrottledLog log_;
  std::mutex mutex_;  ///< of all that follows, until the next comment
  std::optional<BagWriter> bag_;
  std::optional<RecordingWatch> watch_;
  RateMeter images_;
  std::uint64_t recorded_ = 0;
  std::uint64_t lost_ = 0;
  std::string disk_trouble_;
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
