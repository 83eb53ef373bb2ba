#include "node/map_recorder.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <system_error>
#include <utility>

#include <geometry_msgs/Point.h>
#include <nav_msgs/Odometry.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/CompressedImage.h>
#include <sensor_msgs/Image.h>
#include <sensor_msgs/NavSatFix.h>
#include <tf2_msgs/TFMessage.h>
#include <visualization_msgs/Marker.h>

#include "base/files.h"
#include "base/text.h"
#include "base/time.h"
#include "node/node_config.h"
#include "node/stamps.h"
#include "ros/message_readers.h"
#include "visual_localization/features/sift.h"
#include "visual_localization/map/map_builder.h"
#include "visual_localization/map/map_file.h"
#include "visual_localization/parameters/parameters.h"
#include "visual_localization/ros/image_conversion.h"

namespace visual_localization {
namespace {

constexpr std::size_t kImagesOfSpacing = 10;  ///< noise of fixes, or their low rate, must not look like speed
constexpr double kSameLine_m = 2.0;
constexpr std::size_t kNeighbours = 32;  ///< one of each session should be among them

}  // namespace

void WatchConfig::declare(ParameterVisitor& visitor) {
  visitor.real({"max_spacing", "m", "images farther apart than this are called weak"}, max_spacing_m, 0.1, 100.0);
  visitor.real({"max_fix_sigma", "m", "a fix whose receiver claims a larger standard deviation is called poor"},
               max_fix_sigma_m, 0.01, 1000.0);
  visitor.real({"max_fix_age", "s", "without a usable fix for longer than this an image has no position"},
               max_fix_age_s, 0.1, 60.0);
  visitor.integer({"few_features", "1", "an image with fewer SIFT features is called weak"}, few_features, 0, 100000);
}

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

const char* describe(Weakness weakness) {
  switch (weakness) {
    case Weakness::kNone:
      return "good";
    case Weakness::kNoFix:
      return "no usable fix";
    case Weakness::kPoorFix:
      return "poor fixes";
    case Weakness::kFewFeatures:
      return "few features";
    case Weakness::kFarApart:
      return "images too far apart";
  }
  return "";
}

RecordingWatch::RecordingWatch(const WatchConfig& config, std::shared_ptr<const TrainingMap> map)
    : config_(config), map_(std::move(map)) {
  if (map_) frame_.emplace(map_->frame());
}

void RecordingWatch::addFix(const Fix& fix) {
  ++summary_.fixes;
  if (!hasPosition(fix)) return;
  if (!frame_) frame_.emplace(GeodeticPoint{fix.position.latitude_deg, fix.position.longitude_deg, 0.0});
  ++summary_.usable_fixes;
  summary_.fix_sigma_m = fix.sigma_m;
  last_fix_ = fix;
  position_m_ = frame_->toEastNorth(fix.position);
}

bool RecordingWatch::hasPositionAt(std::int64_t stamp_ns) const {
  return last_fix_ && std::abs(secondsBetween(last_fix_->stamp_ns, stamp_ns)) <= config_.max_fix_age_s;
}

void RecordingWatch::addImage(std::int64_t stamp_ns) {
  if (!hasPositionAt(stamp_ns)) {
    last_images_.clear();
    return;
  }
  last_images_.push_back(position_m_);
  if (last_images_.size() > kImagesOfSpacing) last_images_.pop_front();
  const auto steps = static_cast<double>(last_images_.size() - 1);
  summary_.spacing_m = steps > 0.0 ? (last_images_.back() - last_images_.front()).norm() / steps : 0.0;
  addWay();
}

void RecordingWatch::addLook(std::int64_t stamp_ns, std::size_t features) {
  const Weakness weakness = weaknessOf(stamp_ns, features);
  if (last_fix_) spots_.push_back({position_m_, weakness});
  if (hasPositionAt(stamp_ns)) {
    ++placed_;
    known_ += isKnown(stamp_ns) ? 1 : 0;
    summary_.known_way_share = static_cast<double>(known_) / static_cast<double>(placed_);
  }
  ++summary_.images;
  ++summary_.weak[static_cast<std::size_t>(weakness)];
  summary_.now = weakness;
  summary_.features = features;
}

/// In steps that the noise of fixes does not lengthen much.
void RecordingWatch::addWay() {
  constexpr double kStep_m = 3.0;
  if (!way_from_m_) way_from_m_ = position_m_;
  const double step_m = (position_m_ - *way_from_m_).norm();
  if (step_m < kStep_m) return;
  summary_.way_m += step_m;
  way_from_m_ = position_m_;
}

Weakness RecordingWatch::weaknessOf(std::int64_t stamp_ns, std::size_t features) const {
  if (!hasPositionAt(stamp_ns)) return Weakness::kNoFix;
  if (last_fix_->sigma_m > config_.max_fix_sigma_m) return Weakness::kPoorFix;
  if (features < static_cast<std::size_t>(config_.few_features)) return Weakness::kFewFeatures;
  return summary_.spacing_m > config_.max_spacing_m ? Weakness::kFarApart : Weakness::kNone;
}

bool RecordingWatch::isKnown(std::int64_t stamp_ns) const {
  if (!map_) return false;
  const std::vector<Neighbour> neighbours = map_->nearest(position_m_, kNeighbours);
  return std::any_of(neighbours.begin(), neighbours.end(), [&](const Neighbour& neighbour) {
    constexpr std::int64_t kSameLight_ns = 2 * 3'600'000'000'000;
    return neighbour.distance_m <= kSameLine_m &&
           apartInDay_ns(map_->pose(neighbour.image).stamp_ns, stamp_ns) <= kSameLight_ns;
  });
}

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
    assignParameters(builder_, parameters::readYaml(config_.builder_config));
  }
  const auto map = config_.map.empty() ? nullptr : loadMap(config_.map);
  watch_.emplace(config_.watch, map);
  fix_topic_ = node_.resolveName("fix");
  image_topic_ = node_.resolveName("image");
  bag_.emplace(newSessionBag(config_.folder));

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
  updater_.add("recording", this, &MapRecorder::reportRecording);
  updater_.add("session", this, &MapRecorder::reportSession);
  timer_ = node_.createWallTimer(ros::WallDuration(kReportPeriod_s), &MapRecorder::onTimer, this);
  sync_timer_ = node_.createWallTimer(ros::WallDuration(config_.sync_period_s), [this](const ros::WallTimerEvent&) {
    guarded(log_, "recording", [this] { sync(false); });
  });
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
        guarded(log_, "recording", [&] {
          const std::lock_guard<std::mutex> lock(mutex_);
          write(topic, *message);
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

/// The caller holds the mutex.
template <class Message>
void MapRecorder::write(const std::string& topic, const Message& message) {
  const bool latched = topic == kStaticTransforms;
  bag_->write(topic, now(), message, latched) ? ++recorded_ : ++lost_;
  if (bag_->waiting() >= kMostWaiting_bytes && disk_trouble_.empty()) syncBag();
}

/// Each sync writes the whole index again: after hours of small messages only when as much waits.
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
  guarded(log_, "way", [this] { publishWay(); });
  guarded(log_, "diagnostics", [this] { updater_.force_update(); });
}

// What the recorder shows: diagnostics, and the way in rviz.

namespace {

using diagnostic_msgs::DiagnosticStatus;

constexpr std::size_t kMostSpots = 20000;  ///< of a longer way every k-th is shown

std_msgs::ColorRGBA colourOf(Weakness weakness) {
  std_msgs::ColorRGBA colour;
  colour.a = 1.0F;
  colour.r = weakness == Weakness::kNone ? 0.0F : weakness == Weakness::kNoFix ? 0.84F : 0.90F;
  colour.g = weakness == Weakness::kNone ? 0.62F : weakness == Weakness::kNoFix ? 0.10F : 0.62F;
  colour.b = weakness == Weakness::kNone ? 0.45F : 0.0F;
  return colour;
}

}  // namespace

void MapRecorder::publishWay() {
  visualization_msgs::Marker line;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    const std::vector<RecordingWatch::Spot>& spots = watch_->spots();
    if (spots.size() == published_ || spots.size() < 2) return;
    published_ = spots.size();
    const std::size_t step = 1 + spots.size() / kMostSpots;
    for (std::size_t i = 0; i < spots.size(); i += step) {
      geometry_msgs::Point point;
      point.x = spots[i].position_m.x();
      point.y = spots[i].position_m.y();
      line.points.push_back(point);
      line.colors.push_back(colourOf(spots[i].weakness));
    }
  }
  line.header.frame_id = config_.global_frame_id;
  line.header.stamp = ros::Time::now();
  line.ns = "way";
  line.type = visualization_msgs::Marker::LINE_STRIP;
  line.action = visualization_msgs::Marker::ADD;
  line.pose.orientation.w = 1.0;
  line.scale.x = 0.4;
  way_.publish(line);
}

void MapRecorder::reportRecording(Wrapper& status) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (!disk_trouble_.empty()) {
    status.summary(DiagnosticStatus::ERROR, "Nothing is recorded: " + disk_trouble_);
  } else if (images_.rate_hz() == 0.0) {
    status.summary(DiagnosticStatus::ERROR,
                   "No images on " + recorded_topic_ + topics_.hint(recorded_topic_, image_type_));
  } else if (!image_trouble_.empty()) {
    status.summary(DiagnosticStatus::WARN, "Unusable image: " + image_trouble_);
  } else if (!calibration_trouble_.empty()) {
    status.summary(DiagnosticStatus::WARN, "No map can be made: " + calibration_trouble_);
  } else if (lost_ > 0) {
    status.summary(DiagnosticStatus::WARN,
                   std::to_string(lost_) + " messages lost so far: more came than could be kept");
  } else {
    status.summary(DiagnosticStatus::OK, "Recording");
  }
  status.add("Bag", bag_->path());
  status.addf("Size (MB)", "%.1f", static_cast<double>(bag_->size()) * 1e-6);
  std::error_code none;
  const auto space = std::filesystem::space(config_.folder, none);
  if (!none) status.addf("Free (MB)", "%.0f", static_cast<double>(space.available) * 1e-6);
  status.add("Messages", recorded_);
  status.add("Messages lost", lost_);
  status.add("Camera", calibration_.camera() ? describe(*calibration_.camera()) : "not calibrated: a map of places");
  status.addf("Images (Hz)", "%.2f", images_.rate_hz());
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

void MapRecorder::reportSession(Wrapper& status) {
  const std::lock_guard<std::mutex> lock(mutex_);
  const RecordingWatch::Summary seen = watch_->summary();
  constexpr double kMostlyKnown = 0.5;
  if (seen.images == 0) {
    status.summary(DiagnosticStatus::WARN, "No image yet");
  } else if (seen.now != Weakness::kNone) {
    status.summary(DiagnosticStatus::WARN, std::string("Weak here: ") + describe(seen.now));
  } else if (seen.known_way_share > kMostlyKnown) {
    status.summary(DiagnosticStatus::OK, "The map has this way at this time of day: another hour would add more");
  } else {
    status.summary(DiagnosticStatus::OK, "Good");
  }
  status.add("Images looked at", seen.images);
  for (std::size_t i = 1; i < kWeaknesses; ++i) {
    status.add(std::string("Weak: ") + describe(static_cast<Weakness>(i)), seen.weak[i]);
  }
  status.addf("Fixes, usable", "%zu, %zu", seen.fixes, seen.usable_fixes);
  status.addf("Sigma of the fix (m)", "%.2f", seen.fix_sigma_m);
  status.addf("Way (m)", "%.0f", seen.way_m);
  status.addf("Spacing (m)", "%.2f", seen.spacing_m);
  status.add("Features", seen.features);
  if (!config_.map.empty()) status.addf("Way that the map has (%)", "%.0f", 100.0 * seen.known_way_share);
  const std::string trouble = mountTrouble();
  if (!trouble.empty()) status.mergeSummary(DiagnosticStatus::WARN, "Mounting not known: " + trouble);
}

}  // namespace visual_localization
