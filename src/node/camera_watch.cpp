#include "node/camera_watch.h"

#include <exception>
#include <utility>

#include "ros/message_readers.h"
#include "visual_localization/camera/mask.h"
#include "visual_localization/parameters/parameters.h"

namespace visual_localization {
namespace {

/// Names the parameter when its file cannot be used.
template <class Read>
auto ofParameter(const std::string& name, Read read) {
  try {
    return read();
  } catch (const CameraError& error) {
    throw ParameterError("parameter '" + name + "' is not allowed: " + error.what());
  }
}

}  // namespace

CameraWatch::CameraWatch(ros::NodeHandle node, const NodeConfig& config, const std::string& image_topic,
                         SharedLocalizer& localizer, LocalizerDiagnostics& diagnostics, Say say)
    : localizer_(localizer),
      diagnostics_(diagnostics),
      say_(std::move(say)),
      topic_(cameraInfoTopic(image_topic)),
      rectified_(isRectified(image_topic)),
      base_frame_(config.base_frame_id) {
  if (!config.camera_mount.empty()) {
    SensorMount mount;
    mount.camera = parseCameraMount(config.camera_mount);
    localizer_.setMount(mount);
  }
  if (!config.mask_file.empty()) {
    localizer_.setMask(ofParameter("mask_file", [&config] { return readMask(config.mask_file); }));
  }
  const std::string& file = config.camera_info_file;
  if (!file.empty()) use(ofParameter("camera_info_file", [&file] { return readCameraFile(file); }), file);
  report();
  // Last: from here on another thread calls.
  if (file.empty()) subscriber_ = node.subscribe(topic_, 1, &CameraWatch::onCameraInfo, this);
  if (config.camera_mount.empty()) {
    static_transforms_ = node.subscribe("/tf_static", 100, &CameraWatch::onStaticTransforms, this);
    transforms_subscriber_ = node.subscribe("/tf", 100, &CameraWatch::onTransforms, this);
  }
}

void CameraWatch::onStaticTransforms(const tf2_msgs::TFMessageConstPtr& message) {
  const std::lock_guard<std::mutex> lock(mutex_);
  transforms_.add(*message);
  findMount();
}

void CameraWatch::onTransforms(const tf2_msgs::TFMessageConstPtr& message) {
  const std::lock_guard<std::mutex> lock(mutex_);
  transforms_.addPublished(*message);
  if (!mount_) findMount();
}

void CameraWatch::imageFrameIs(const std::string& frame) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (frame != camera_frame_) {
    camera_frame_ = frame;
    findMount();
  }
  sayMountTrouble();
}

void CameraWatch::findMount() {
  if (!camera_frame_) return;
  try {
    const std::optional<RobotMount> found = robotMount(transforms_, base_frame_, *camera_frame_, std::nullopt);
    mount_trouble_.clear();
    if (!found) return;
    const CameraPose& camera = found->mount.camera;
    const bool known = mount_ && mount_->camera.position_m == camera.position_m &&
                       mount_->camera.rotation.coeffs() == camera.rotation.coeffs();
    if (known) return;
    mount_.emplace().camera = camera;
    localizer_.setMount(*mount_);
    say_(false, "Camera mounting from /tf_static: " + base_frame_ + " to " + *camera_frame_ + " (" + found->said + ")");
  } catch (const MountError& error) {
    if (mount_trouble_.empty()) trouble_since_ = ros::WallTime::now();
    mount_trouble_ = error.what();
  }
}

/// Not at once: frames come from several publishers.
void CameraWatch::sayMountTrouble() {
  constexpr double kPatience_s = 3.0;
  if (mount_trouble_.empty() || mount_trouble_ == mount_said_) return;
  if ((ros::WallTime::now() - trouble_since_).toSec() < kPatience_s) return;
  mount_said_ = mount_trouble_;
  say_(true, "Camera mounting not known, the map's is used: " + mount_trouble_);
}

void CameraWatch::onCameraInfo(const sensor_msgs::CameraInfoConstPtr& info) {
  const std::lock_guard<std::mutex> lock(mutex_);
  const bool calibrated = isCalibrated(*info, rectified_);
  if (!calibrated && last_) return;                     // of a second publisher
  if (last_ && sameCalibration(*info, *last_)) return;  // comes with every image
  if (calibrated) last_ = info;
  try {
    if (const std::optional<CameraModel> camera = toCamera(*info, rectified_)) {
      use(*camera, topic_);
    } else {
      refuse(topic_ + ": the camera is not calibrated: its matrix is zero");
    }
  } catch (const std::exception& error) {
    refuse(topic_ + ": " + error.what());
  }
  report();
}

void CameraWatch::use(const CameraModel& camera, const std::string& source) {
  trouble_.clear();
  if (camera_ == camera) return;
  if (camera_) {
    say_(true, "The calibration of the camera changes: " + differences(camera, *camera_) + "; " + source);
  } else {
    say_(false, "Camera: " + describe(camera) + ", from " + source);
  }
  camera_ = camera;
  source_ = source;
  localizer_.setCamera(camera);
  compareWithMap();
}

/// The calibration before, or the map's, goes on.
void CameraWatch::refuse(const std::string& reason) {
  if (reason == trouble_) return;  // a NaN differs from itself, and so each message from the one before
  trouble_ = reason;
  say_(true, "Calibration refused: " + reason);
}

void CameraWatch::mapIs(const MapHeader& map) {
  const std::lock_guard<std::mutex> lock(mutex_);
  const Session& first = map.sessions.front();
  of_map_ = first.published ? first.published : first.camera;  // what a camera says of itself
  map_size_ = map.image_size;
  if (!of_map_) say_(false, "The map has no calibration: places only");
  compareWithMap();
  report();
}

/// A difference is allowed, but reported.
void CameraWatch::compareWithMap() {
  if (!camera_ || !of_map_) return;
  const std::string words = differences(camera_->scaledTo(map_size_), *of_map_);
  if (!words.empty() && words != said_) say_(false, "The camera differs from the map's: " + words);
  said_ = words;
}

void CameraWatch::report() {
  std::string text = "No calibration: places only";
  if (camera_) {
    text = describe(*camera_) + ", from " + source_;
  } else if (of_map_) {
    text = describe(*of_map_) + ", from the map";
  }
  diagnostics_.cameraIs(said_.empty() ? text : text + "; not the map's: " + said_, trouble_);
}

}  // namespace visual_localization
