#include "node/map_recorder.h"

#include <algorithm>
#include <filesystem>
#include <utility>

#include <nav_msgs/Odometry.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/CompressedImage.h>
#include <sensor_msgs/Image.h>
#include <sensor_msgs/NavSatFix.h>
#include <tf2_msgs/TFMessage.h>

#include "base/files.h"
#include "base/text.h"
#include "node/node_config.h"
#include "node/recorder_report.h"
#include "node/stamps.h"
#include "ros/message_readers.h"
#include "visual_localization/features/sift.h"
#include "visual_localization/map/map_builder.h"
#include "visual_localization/map/map_file.h"
#include "visual_localization/parameters/parameters.h"
#include "visual_localization/ros/image_conversion.h"

namespace visual_localization {
void RecorderConfig::declare(ParameterVisitor& visitor) {
  visitor.text({"folder", "", "where the recording and its map go, an absolute path"}, folder);
  visitor.text({"map", "", "a map that this session will be added to; empty: it makes a map of its own"}, map);
  visitor.choice({"image_transport", "", "raw: the topic image; compressed: image/compressed"}, image_transport,
                 {"raw", "compressed"});
  visitor.text({"builder_config", "", "YAML file of the map builder's parameters; empty: its defaults"},
               builder_config);
  visitor.real({"sync_period", "s",
                "how often the recording is put on the disk; less often where its index is larger than what waits"},
               sync_period_s, 0.5, 60.0);
  visitor.text({"global_frame_id", "", "frame of the way in rviz"}, global_frame_id);
  watch.declare(visitor);
  visitor.require(!folder.empty() && folder.front() == '/', "folder", "'" + folder + "'", "an absolute path");
}

namespace {

const char* const kStaticTransforms = "/tf_static";
constexpr std::uint32_t kSlowQueue = 100;  ///< while the disk is slow
constexpr std::uint32_t kFastQueue = 1000;
constexpr double kReportPeriod_s = 1.0;
constexpr int kLongestSide_px = 640;  ///< larger images are looked at in this size: a weak one shows there too

std::int64_t stampOf(const std_msgs::Header& header) {
  return static_cast<std::int64_t>((header.stamp.isZero() ? receivedNow() : header.stamp).toNSec());
}

}  // namespace

MapRecorder::MapRecorder(const ros::NodeHandle& node, const ros::NodeHandle& private_node, BuildMap build_map)
    : node_(node),
      private_node_(private_node),
      build_map_(std::move(build_map)),
      log_([](ThrottledLog::Severity severity, const std::string& text) {
        if (severity == ThrottledLog::Severity::kError) {
          ROS_ERROR_STREAM(text);
        } else {
          ROS_WARN_STREAM(text);
        }
      }),
      extractor_(makeSiftExtractor({})),
      updater_(node, private_node, ros::this_node::getName()) {
  assignParameters(config_, privateParameters(private_node_));
  if (!config_.builder_config.empty()) {  // a wrong one would be found after the round
    assignParameters(builder_, mapBuilderValues(parameters::readYaml(config_.builder_config), valuesOf(builder_)));
  }
  const auto map = config_.map.empty() ? nullptr : loadMap(config_.map);
  watch_.emplace(config_.watch, map);
  fix_topic_ = node_.resolveName("fix");
  image_topic_ = node_.resolveName("image");
  bag_.emplace(config_.folder);

  calibration_ = SingleCalibration(isRectified(image_topic_));
  if (config_.image_transport == "compressed") {
    recordImages<sensor_msgs::CompressedImage>(image_topic_ + "/compressed");
  } else {
    recordImages<sensor_msgs::Image>(image_topic_);
  }
  record<sensor_msgs::CameraInfo>(cameraInfoTopic(image_topic_), kSlowQueue,
                                  [this](const sensor_msgs::CameraInfoConstPtr& info) { watchCalibration(*info); });
  record<sensor_msgs::NavSatFix>("fix", kFastQueue, [this](const sensor_msgs::NavSatFixConstPtr& fix) {
    fix_frame_ = withoutSlash(fix->header.frame_id);
    watch_->addFix(toFix(*fix, stampOf(fix->header)));
  });
  record<nav_msgs::Odometry>("odom", kFastQueue);
  record<tf2_msgs::TFMessage>(kStaticTransforms, kFastQueue,
                              [this](const tf2_msgs::TFMessageConstPtr& message) { transforms_.add(*message); });
  record<tf2_msgs::TFMessage>(
      "/tf", kFastQueue, [this](const tf2_msgs::TFMessageConstPtr& message) { transforms_.addPublished(*message); });

  way_ = private_node_.advertise<visualization_msgs::Marker>("way", 1, true);
  ros::NodeHandle services(private_node_);
  services.setCallbackQueue(&services_);
  write_map_ = services.advertiseService("write_map", &MapRecorder::onWriteMap, this);
  updater_.setHardwareID("none");
  updater_.add("recording", this, &MapRecorder::reportRecordingTo);
  updater_.add("session", this, &MapRecorder::reportSessionTo);
  timer_ = node_.createWallTimer(ros::WallDuration(kReportPeriod_s), &MapRecorder::onTimer, this);
  sync_timer_ = node_.createWallTimer(ros::WallDuration(config_.sync_period_s), [this](const ros::WallTimerEvent&) {
    guarded(log_, "recording", [this] { syncSometimes(); });
  });
  service_spinner_.emplace(1, &services_);
  service_spinner_->start();
  looker_ = std::thread([this] { lookAtImages(); });
  ROS_INFO_STREAM("Recording " << image_topic_ << ", " << fix_topic_ << ", odometry and static transforms to "
                               << bag_->path());
}

MapRecorder::~MapRecorder() {
  sync();  // first: a map that is being written takes minutes, and roslaunch does not wait for it
  service_spinner_.reset();
  timer_.stop();
  sync_timer_.stop();
  for (ros::Subscriber& subscriber : subscribers_) subscriber.shutdown();
  queue_.close();
  if (looker_.joinable()) looker_.join();
  ROS_INFO_STREAM("Recorded " << bag_->recorded() << " messages in " << bag_->path());
}

/// `look` is called for each message, with the mutex held.
template <class Message>
void MapRecorder::record(const std::string& name, std::uint32_t queue, Look<Message> look) {
  const std::string topic = node_.resolveName(name);
  const boost::function<void(const boost::shared_ptr<const Message>&)> keep =
      [this, topic, look](const boost::shared_ptr<const Message>& message) {
        guarded(log_, "recording", [&] {
          const std::lock_guard<std::mutex> lock(mutex_);
          bag_->write(topic, *message, topic == kStaticTransforms);
          if (look) look(message);
        });
      };
  subscribers_.push_back(
      node_.subscribe<Message>(topic, queue, keep, ros::VoidConstPtr(), ros::TransportHints().tcpNoDelay()));
}

template <class Message>
void MapRecorder::recordImages(const std::string& topic) {
  recorded_topic_ = node_.resolveName(topic);
  image_type_ = ros::message_traits::datatype<Message>();
  record<Message>(topic, kSlowQueue, [this](const boost::shared_ptr<const Message>& message) {
    images_.add();
    image_frame_ = withoutSlash(message->header.frame_id);
    watch_->addImage(stampOf(message->header));
    queue_.push({message->header, [message] { return toGrey(*message); }});
  });
}

/// What the map builder would say of it. The caller holds the mutex.
void MapRecorder::watchCalibration(const sensor_msgs::CameraInfo& info) {
  try {
    if (!calibration_.add(info)) calibration_trouble_ = "the calibration changes while it records";
  } catch (const CameraError& error) {
    calibration_trouble_ = oneLine(error.what());
  }
  if (!calibration_trouble_.empty()) log_.warn("calibration", "Calibration of the camera: " + calibration_trouble_);
}

void MapRecorder::sync() {
  const std::lock_guard<std::mutex> lock(mutex_);
  bag_->sync();
  reportDisk();
}

void MapRecorder::syncSometimes() {
  const std::lock_guard<std::mutex> lock(mutex_);
  bag_->syncSometimes();
  reportDisk();
}

/// The caller holds the mutex.
void MapRecorder::reportDisk() {
  if (!bag_->trouble().empty()) log_.error("disk", "Nothing is recorded: " + bag_->trouble());
}

/// Only of the newest image: the thread is not to keep the robot busy.
void MapRecorder::lookAtImages() {
  while (const auto image = queue_.pop()) {
    std::string trouble;
    std::size_t features = 0;
    try {
      features = featuresOf(image->decode());
    } catch (const std::exception& error) {
      trouble = oneLine(error.what());
      log_.warn("image", "Unusable image on " + image_topic_ + ": " + trouble);
    }
    const std::lock_guard<std::mutex> lock(mutex_);
    image_trouble_ = trouble;
    if (trouble.empty()) watch_->addLook(stampOf(image->header), features);
  }
}

std::size_t MapRecorder::featuresOf(const cv::Mat& grey) {
  cv::Mat resized;
  cv::Mat spread;
  const double scale = static_cast<double>(kLongestSide_px) / std::max(grey.cols, grey.rows);
  const cv::Size size = scale < 1.0 ? cv::Size(std::max(16, static_cast<int>(grey.cols * scale)),
                                               std::max(16, static_cast<int>(grey.rows * scale)))
                                    : grey.size();
  const cv::Mat& seen = fitted(grey, size, resized);
  return extractor_->extract(withUsualContrast(seen, greyLevelsOf(seen), spread)).size();
}

RecordedSession MapRecorder::sessionFor(const std::string& path) const {
  RecordedSession session{bag_->path(), image_topic_, fix_topic_, config_.map, config_.builder_config, {}};
  session.output = path.empty() ? std::filesystem::path(bag_->path()).replace_extension(".map").string()
                                : mapFileBelow(config_.folder, path, "folder");
  if (std::filesystem::path(session.output).extension() != ".map") {
    throw MapStoreError(oneLine(path) + ": a map file must end in .map");
  }
  return session;
}

bool MapRecorder::onWriteMap(WriteMap::Request& request, WriteMap::Response& response) {
  try {
    sync();
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      if (!bag_->trouble().empty()) throw FileError(bag_->trouble());
    }
    const RecordedSession session = sessionFor(request.path);
    build_map_(session);
    response.images = static_cast<std::uint32_t>(loadMap(session.output, {0, {}})->size());
    response.map = session.output;
    response.success = true;
    response.message = oneLine("wrote " + session.output);
    ROS_INFO_STREAM("Map " << oneLine(session.output) << " with " << response.images << " training images");
  } catch (const std::exception& error) {
    response.success = false;
    response.message = oneLine(error.what());
    ROS_WARN_STREAM("Map not written: " << response.message);
  }
  return true;
}

void MapRecorder::onTimer(const ros::WallTimerEvent&) {
  guarded(log_, "way", [this] { publishWay(); });
  guarded(log_, "diagnostics", [this] { updater_.force_update(); });
}

void MapRecorder::publishWay() {
  std::vector<RecordingWatch::Spot> spots;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (watch_->spots().size() == published_ || watch_->spots().size() < 2) return;
    spots = watch_->spots();
    published_ = spots.size();
  }
  way_.publish(wayMarker(spots, config_.global_frame_id));
}

void MapRecorder::reportRecordingTo(Wrapper& status) {
  const std::lock_guard<std::mutex> lock(mutex_);
  RecordingStatus recording;
  recording.image_rate_hz = images_.rate_hz();
  if (recording.image_rate_hz == 0.0)
    recording.no_images = recorded_topic_ + topics_.hint(recorded_topic_, image_type_);
  recording.image_trouble = image_trouble_;
  recording.calibration_trouble = calibration_trouble_;
  recording.camera = calibration_.camera();
  reportRecording(recording, *bag_, config_.folder, status);
}

void MapRecorder::reportSessionTo(Wrapper& status) {
  const std::lock_guard<std::mutex> lock(mutex_);
  reportSession(watch_->summary(), !config_.map.empty(), mountTrouble(), status);
}

/// Why the map will not know the mounting; empty when it will, or nobody says anything of frames. The caller holds the
/// mutex.
std::string MapRecorder::mountTrouble() const {
  if (!image_frame_ || !fix_frame_ || !builder_.camera_mount.empty()) return "";
  const auto antenna = builder_.antenna_mount.empty() ? fix_frame_ : std::nullopt;
  try {
    robotMount(transforms_, builder_.base_frame, *image_frame_, antenna);
    return "";
  } catch (const MountError& error) {
    return oneLine(error.what(), 1000);
  }
}

}  // namespace visual_localization
