#include "node/map_recorder.h"

#include <chrono>
#include <filesystem>
#include <utility>

#include <nav_msgs/Odometry.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/CompressedImage.h>
#include <sensor_msgs/Image.h>
#include <sensor_msgs/NavSatFix.h>
#include <tf2_msgs/TFMessage.h>
#include <visualization_msgs/Marker.h>

#include "base/files.h"
#include "base/text.h"
#include "node/node_config.h"
#include "ros/camera_info.h"
#include "ros/message_readers.h"
#include "visual_localization/map/map_builder.h"
#include "visual_localization/map/map_file.h"
#include "visual_localization/parameters/parameters.h"
#include "visual_localization/ros/image_conversion.h"

namespace visual_localization {
namespace {

const char* const kStaticTransforms = "/tf_static";
constexpr std::uint64_t kMostWaiting_bytes = 16U << 20U;  ///< raw images of a fast camera do not wait for the period
constexpr std::uint64_t kSmallIndex_bytes = 64U << 10U;
constexpr std::uint32_t kSlowQueue = 100;  ///< while the disk is slow
constexpr std::uint32_t kFastQueue = 1000;
constexpr double kReportPeriod_s = 1.0;
constexpr int kLongestSide_px = 640;  ///< larger images are looked at in this size: a weak one shows there too

/// A bag knows no time before the first clock message of a simulation.
ros::Time now() {
  const ros::Time time = ros::Time::now();
  return time.isZero() ? ros::Time(ros::WallTime::now().toSec()) : time;
}

std::int64_t stampOf(const std_msgs::Header& header) {
  return static_cast<std::int64_t>((header.stamp.isZero() ? now() : header.stamp).toNSec());
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
      extractor_(makeSiftExtractor({}, siftBackends().front())),
      updater_(node, private_node, ros::this_node::getName()) {
  assignParameters(config_, privateParameters(private_node_));
  if (!config_.builder_config.empty()) {  // a wrong one would be found after the round
    MapBuilderConfig attempt;
    assignParameters(attempt, parameters::readYaml(config_.builder_config));
  }
  const auto map = config_.map.empty() ? nullptr : loadMap(config_.map);
  watch_.emplace(config_.watch, map);
  fix_topic_ = node_.resolveName("fix");
  image_topic_ = node_.resolveName("image");
  bag_.emplace(newSessionBag(config_.folder));

  if (config_.image_transport == "compressed") {
    recordImages<sensor_msgs::CompressedImage>(image_topic_ + "/compressed");
  } else {
    recordImages<sensor_msgs::Image>(image_topic_);
  }
  record<sensor_msgs::CameraInfo>(cameraInfoTopic(image_topic_), kSlowQueue);
  record<sensor_msgs::NavSatFix>("fix", kFastQueue, [this](const sensor_msgs::NavSatFixConstPtr& fix) {
    watch_->addFix(toFix(*fix, stampOf(fix->header)));
  });
  record<nav_msgs::Odometry>("odom", kFastQueue);
  record<tf2_msgs::TFMessage>(kStaticTransforms, kFastQueue);

  way_ = private_node_.advertise<visualization_msgs::Marker>("way", 1, true);
  ros::NodeHandle services(private_node_);
  services.setCallbackQueue(&services_);
  write_map_ = services.advertiseService("write_map", &MapRecorder::onWriteMap, this);
  updater_.setHardwareID("none");
  updater_.add("recording", this, &MapRecorder::reportRecording);
  updater_.add("session", this, &MapRecorder::reportSession);
  timer_ = node_.createWallTimer(ros::WallDuration(kReportPeriod_s), &MapRecorder::onTimer, this);
  sync_timer_ = node_.createWallTimer(ros::WallDuration(config_.sync_period_s),
                                      [this](const ros::WallTimerEvent&) { sync(false); });
  service_spinner_.emplace(1, &services_);
  service_spinner_->start();
  looker_ = std::thread([this] { lookAtImages(); });
  ROS_INFO_STREAM("Recording " << image_topic_ << ", " << fix_topic_ << ", odometry and static transforms to "
                               << bag_->path());
}

MapRecorder::~MapRecorder() {
  sync(true);  // first: a map that is being written takes minutes, and roslaunch does not wait for it
  service_spinner_.reset();
  timer_.stop();
  sync_timer_.stop();
  for (ros::Subscriber& subscriber : subscribers_) subscriber.shutdown();
  queue_.close();
  if (looker_.joinable()) looker_.join();
  ROS_INFO_STREAM("Recorded " << recorded_ << " messages in " << bag_->path());
}

/// `look` is called for each message, with the mutex held.
template <class Message>
void MapRecorder::record(const std::string& name, std::uint32_t queue, Look<Message> look) {
  const std::string topic = node_.resolveName(name);
  const boost::function<void(const boost::shared_ptr<const Message>&)> keep =
      [this, topic, look](const boost::shared_ptr<const Message>& message) {
        const std::lock_guard<std::mutex> lock(mutex_);
        write(topic, *message);
        if (look) look(message);
      };
  subscribers_.push_back(
      node_.subscribe<Message>(topic, queue, keep, ros::VoidConstPtr(), ros::TransportHints().tcpNoDelay()));
}

template <class Message>
void MapRecorder::recordImages(const std::string& topic) {
  record<Message>(topic, kSlowQueue, [this](const boost::shared_ptr<const Message>& message) {
    images_.add();
    watch_->addImage(stampOf(message->header));
    queue_.push({message->header, [message] { return toGrey(*message); }});
  });
}

/// The caller holds the mutex.
template <class Message>
void MapRecorder::write(const std::string& topic, const Message& message) {
  const bool latched = topic == kStaticTransforms;
  bag_->write(topic, now(), message, latched) ? ++recorded_ : ++lost_;
  if (bag_->waiting() >= kMostWaiting_bytes && disk_trouble_.empty()) syncBag();
}

/// Each sync writes the whole index again. After hours of small messages it is worth that only when as much waits:
/// otherwise the bag would be mostly indices.
void MapRecorder::sync(bool at_once) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (at_once || bag_->waiting() + kSmallIndex_bytes >= bag_->indexSize()) syncBag();
}

void MapRecorder::syncBag() {
  try {
    bag_->sync();
    disk_trouble_.clear();
  } catch (const FileError& error) {
    disk_trouble_ = oneLine(error.what());
    log_.error("disk", "Nothing is recorded: " + disk_trouble_);
  }
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
    sync(true);
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      if (!disk_trouble_.empty()) throw FileError(disk_trouble_);
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
  publishWay();
  updater_.force_update();
}

}  // namespace visual_localization
