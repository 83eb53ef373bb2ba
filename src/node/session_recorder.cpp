#include "node/session_recorder.h"

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <filesystem>
#include <stdexcept>
#include <utility>
#include <vector>

#include <opencv2/imgcodecs.hpp>
#include <sensor_msgs/CompressedImage.h>
#include <tf2_eigen/tf2_eigen.h>
#include <tf2_msgs/TFMessage.h>

#include "base/files.h"
#include "base/numbers.h"
#include "base/text.h"
#include "node/message_conversions.h"
#include "node/node_config.h"
#include "ros/message_readers.h"
#include "visual_localization/map/map_file.h"

namespace visual_localization {
namespace {

constexpr std::chrono::seconds kSavePeriod{60};
constexpr std::size_t kLargestUsage_bytes = std::size_t{256} << 20U;

MapUsage readUsage(const std::string& path) {
  const PartialFile attempt(path);  // what cannot be written is said now
  if (!std::filesystem::exists(path)) return {};
  try {
    return MapUsage::fromCsv(readFile(path, kLargestUsage_bytes));
  } catch (const UsageFileError& error) {
    throw UsageFileError(oneLine(path) + ": " + error.what());
  }
}

}  // namespace

UsageRecorder::UsageRecorder(std::string path, ThrottledLog& log)
    : path_(std::move(path)), log_(log), lock_(path_), usage_(readUsage(path_)) {}

UsageRecorder::~UsageRecorder() {
  if (saving_.valid()) saving_.wait();
  if (changed_) save();
}

void UsageRecorder::publish(const LocalizedImage& image, const ImageCounts&) {
  const SharedLocalizer::Result& result = image.result;
  if (result.estimate.source != PoseSource::kMetric || result.estimate.repeats > 0) return;
  usage_.add(*result.map, result.landmarks);
  changed_ = true;
  if (std::chrono::steady_clock::now() - saved_ >= kSavePeriod) save();
}

void UsageRecorder::save() {
  saved_ = std::chrono::steady_clock::now();
  changed_ = false;
  saving_ = std::async(std::launch::async, [this, usage = usage_] {
    try {
      writeFile(path_, usage.toCsv());
    } catch (const FileError& error) {
      log_.error("usage", std::string("Usage of the map is not saved: ") + error.what());
    }
  });
}

namespace {

constexpr std::chrono::seconds kSyncPeriod{5};
constexpr double kLeastWay_m = 0.2;       ///< between recorded images
constexpr double kLeastTurn_rad = 0.087;  ///< five degrees
constexpr std::size_t kMostQueued = 20;   ///< images; more are left out while the disk is slow
constexpr int kFastPng = 1;
constexpr int kMapNiceness = 10;       ///< of what writes a map, while the robot drives
constexpr std::uint32_t kThreads = 2;  ///< one for a map, one for refusals meanwhile

const char* const kImages = "/session/image";
const char* const kPoses = "/session/verified_pose";
const char* const kCameraFrame = "session_camera";
const char* const kRobotFrame = "base_link";

std::string withEnding(const std::string& bag, const char* ending) {
  return std::filesystem::path(bag).replace_extension(ending).string();
}

void writeMask(const std::string& path, const Mask& mask) {
  std::vector<std::uint8_t> png;
  cv::imencode(".png", mask.grey(), png);
  writeFile(path, std::string(png.begin(), png.end()));
}

tf2_msgs::TFMessage mountMessage(const SensorMount& mount, const ros::Time& stamp) {
  Eigen::Isometry3d camera = Eigen::Isometry3d::Identity();
  camera.linear() = mount.camera.rotation.toRotationMatrix();
  camera.translation() = mount.camera.position_m;
  tf2_msgs::TFMessage message;
  message.transforms.push_back(tf2::eigenToTransform(camera));
  message.transforms.back().header.frame_id = kRobotFrame;
  message.transforms.back().header.stamp = stamp;
  message.transforms.back().child_frame_id = kCameraFrame;
  return message;
}

bool isFarFrom(const PoseEstimate& last, const PoseEstimate& pose) {
  return (pose.position_m - last.position_m).norm() >= kLeastWay_m ||
         std::abs(angleDifference(last.yaw_rad, pose.yaw_rad)) >= kLeastTurn_rad;
}

}  // namespace

SessionRecorder::SessionRecorder(std::string folder, Extend extend, ThrottledLog& log)
    : folder_(std::move(folder)), extend_(std::move(extend)), log_(log), map_edit_(kMapNiceness) {
  thread_ = std::thread([this] { work(); });
}

SessionRecorder::~SessionRecorder() {
  map_edit_.terminate();
  spinner_.reset();
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    ends_ = true;
  }
  changed_.notify_all();
  thread_.join();
  if (session_) ROS_WARN_STREAM("The session that was being recorded is in " << session_->bag->path());
}

void SessionRecorder::offer(ros::NodeHandle private_node) {
  private_node.setCallbackQueue(&queue_);
  service_ = private_node.advertiseService("record_session", &SessionRecorder::onRecordSession, this);
  spinner_ = std::make_unique<ros::AsyncSpinner>(kThreads, &queue_);
  spinner_->start();
  std::error_code none;
  if (!folder_.empty() && !std::filesystem::is_directory(folder_, none)) {
    ROS_WARN_STREAM("session_folder " << oneLine(folder_) << " is not a folder, so no session can be recorded");
  }
}

void SessionRecorder::mapIs(const std::string& path, std::shared_ptr<const TrainingMap> map) {
  const std::lock_guard<std::mutex> lock(mutex_);
  map_path_ = path;
  map_ = std::move(map);
}

bool SessionRecorder::onRecordSession(RecordSession::Request& request, RecordSession::Response& response) {
  try {
    if (folder_.empty()) throw FileError("~session_folder is not set: there is nowhere to record");
    if (request.record) {
      response.message = oneLine("recording to " + begin());
    } else {
      end(request.path, response);
    }
    response.success = true;
  } catch (const std::exception& error) {
    response.success = false;
    response.message = oneLine(error.what());
    ROS_WARN_STREAM("Session: " << response.message);
  }
  return true;
}

std::string SessionRecorder::begin() {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (writes_map_) throw FileError("the map of the session before is being written");
  if (session_) throw FileError("a session is being recorded already, in " + session_->bag->path());
  if (!map_) throw FileError("no map is loaded");
  if (!map_->hasGeometry()) throw FileError(map_path_ + ": has no landmarks, so it verifies no pose");
  auto session = std::make_unique<Session>();
  session->map_path = map_path_;
  session->map = map_;
  session->bag = std::make_unique<BagWriter>(newSessionBag(folder_));
  session_ = std::move(session);
  ROS_INFO_STREAM("Recording verified images to " << session_->bag->path());
  return session_->bag->path();
}

void SessionRecorder::end(const std::string& path, RecordSession::Response& response) {
  const std::string output = outputOf(path);
  const std::unique_ptr<Session> session = take();
  const std::string bag = session->bag->path();
  const std::shared_ptr<void> done(nullptr, [this](void*) {
    const std::lock_guard<std::mutex> lock(mutex_);
    writes_map_ = false;
  });
  try {
    const SessionExtension extension = saved(*session, output);
    extend_(extension, map_edit_);
    response.map = extension.output;
    response.images = static_cast<std::uint32_t>(loadMap(extension.output, {0, {}})->size());
  } catch (const std::exception& error) {
    throw std::runtime_error(std::string(error.what()) + "; what was recorded is in " + bag);
  }
  response.message = oneLine("wrote " + response.map + " with " + std::to_string(session->images) + " recorded images");
  ROS_INFO_STREAM("Session: " << response.message);
}

/// An unusable name ends no session.
std::string SessionRecorder::outputOf(const std::string& path) const {
  if (path.empty()) return {};
  const std::string output = mapFileBelow(folder_, path, "session_folder");
  if (std::filesystem::path(output).extension() != ".map") throw FileError(oneLine(path) + ": must end in .map");
  const std::lock_guard<std::mutex> lock(mutex_);
  std::error_code none;
  if (session_ && std::filesystem::equivalent(output, session_->map_path, none)) {
    throw FileError(oneLine(path) + ": is the map that the session extends");
  }
  const PartialFile attempt(output);
  return output;
}

/// Null when the disk is full or nothing was recorded.
std::unique_ptr<SessionRecorder::Session> SessionRecorder::take() {
  std::unique_lock<std::mutex> lock(mutex_);
  changed_.wait(lock, [this] { return waiting_.empty() && !working_; });
  if (!session_) throw FileError("no session is being recorded");
  const std::string bag = session_->bag->path();
  session_->bag->sync();
  if (session_->images == 0) {
    const std::string map_path = session_->map_path;
    session_.reset();
    std::error_code none;
    std::filesystem::remove(bag, none);
    throw FileError("no image was verified: nothing to add to " + map_path);
  }
  writes_map_ = true;
  return std::move(session_);
}

SessionExtension SessionRecorder::saved(const Session& session, const std::string& output) const {
  const std::string& bag = session.bag->path();
  SessionExtension extension{session.map_path, bag, kImages, kPoses, "", withEnding(bag, ".usage.csv"), output};
  if (session.has_mask) extension.mask = withEnding(bag, ".mask.png");
  if (extension.output.empty()) extension.output = withEnding(bag, ".map");
  writeFile(extension.usage, session.usage.toCsv());
  return extension;
}

void SessionRecorder::publish(const LocalizedImage& image, const ImageCounts&) {
  const Estimate& estimate = image.result.estimate;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (!session_ || image.result.map != session_->map || !image.result.camera) return;
    if (!estimate.evidence.verified.value_or(false) || estimate.repeats > 0) return;
    session_->usage.add(*image.result.map, image.result.landmarks);
    if (session_->last && !isFarFrom(*session_->last, estimate.pose)) return;
    if (waiting_.size() == kMostQueued) {
      return log_.warn("session", "The disk is slow: images are left out of the session");
    }
    session_->last = estimate.pose;
    waiting_.push_back(image);
  }
  changed_.notify_all();
}

/// Of the thread; nothing waits longer than the period.
void SessionRecorder::work() {
  auto synced = std::chrono::steady_clock::now();
  std::unique_lock<std::mutex> lock(mutex_);
  for (;;) {
    changed_.wait_for(lock, kSyncPeriod, [this] { return ends_ || !waiting_.empty(); });
    const bool last = ends_ && waiting_.empty();
    if (session_) {
      Session& session = *session_;  // take() leaves it alone while this works
      std::optional<LocalizedImage> image;
      if (!waiting_.empty()) {
        image = std::move(waiting_.front());
        waiting_.pop_front();
      }
      working_ = true;
      lock.unlock();
      if (image) tryToRecord(session, *image);
      if (last || std::chrono::steady_clock::now() - synced >= kSyncPeriod) {
        sync(session);
        synced = std::chrono::steady_clock::now();
      }
      lock.lock();
      working_ = false;
      changed_.notify_all();
    }
    if (last) return;
  }
}

/// An image that cannot be recorded ends no thread.
void SessionRecorder::tryToRecord(Session& session, const LocalizedImage& image) {
  try {
    record(session, image);
  } catch (const std::exception& error) {
    log_.error("session", std::string("An image is not recorded: ") + error.what());
  }
}

void SessionRecorder::record(Session& session, const LocalizedImage& image) const {
  BagWriter& bag = *session.bag;
  const ros::Time& stamp = image.header.stamp;
  std_msgs::Header header = image.header;
  header.frame_id = kCameraFrame;
  sensor_msgs::CompressedImage compressed;
  compressed.header = header;
  compressed.format = "png";
  cv::imencode(".png", image.grey, compressed.data, {cv::IMWRITE_PNG_COMPRESSION, kFastPng});
  sensor_msgs::CameraInfo camera = toMessage(image.result.camera->scaledTo(image.grey.size()));
  camera.header = header;
  header.frame_id = kRobotFrame;
  sensor_msgs::NavSatFix pose = toFix(image.result.estimate, header);
  pose.status.status = sensor_msgs::NavSatStatus::STATUS_FIX;

  if (session.images == 0) {
    constexpr bool kLatched = true;
    if (!bag.write("/tf_static", stamp, mountMessage(image.result.mount, stamp), kLatched)) return;
    session.has_mask = !image.result.mask.empty();
    if (session.has_mask) writeMask(withEnding(bag.path(), ".mask.png"), image.result.mask);
  }
  const bool kept = bag.write(cameraInfoTopic(kImages), stamp, camera) &&
                    bag.write(std::string(kImages) + "/compressed", stamp, compressed) &&
                    bag.write(kPoses, stamp, pose);
  if (kept) ++session.images;  // otherwise the disk is full, which sync() says
}

void SessionRecorder::sync(Session& session) {
  try {
    session.bag->sync();
  } catch (const std::exception& error) {
    log_.error("session", std::string("The session is not recorded: ") + error.what());
  }
}

}  // namespace visual_localization
