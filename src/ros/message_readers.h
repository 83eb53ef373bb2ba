#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include <nav_msgs/Odometry.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/NavSatFix.h>

#include "ros/static_transforms.h"
#include "visual_localization/camera/camera_model.h"
#include "visual_localization/geo/trajectory.h"
#include "visual_localization/localization/odometry.h"

namespace visual_localization {

/// For images as they are sent: a region of interest is cut out and binned pixels are larger. Nothing when K is all
/// zeros: not calibrated. `rectified`: images of image_proc, so P holds, without distortion. Throws CameraError when
/// the calibration cannot be used.
std::optional<CameraModel> toCamera(const sensor_msgs::CameraInfo& info, bool rectified = false);

/// Inverse of toCamera(), not rectified; its header is empty.
sensor_msgs::CameraInfo toMessage(const CameraModel& camera);

/// The matrix of a camera that nobody has calibrated is all zeros.
bool isCalibrated(const sensor_msgs::CameraInfo& info, bool rectified = false);

/// But for rounding, whatever their headers.
bool sameCalibration(const sensor_msgs::CameraInfo& a, const sensor_msgs::CameraInfo& b);

/// What many messages say of one camera. Those that are not calibrated, as before a driver has read its file, do not
/// count.
class SingleCalibration {
 public:
  explicit SingleCalibration(bool rectified) : rectified_(rectified) {}

  /// False when it differs from the first one that is calibrated. Throws CameraError when that cannot be used.
  bool add(const sensor_msgs::CameraInfo& info);
  const std::optional<CameraModel>& camera() const { return camera_; }

 private:
  bool rectified_;
  std::optional<sensor_msgs::CameraInfo> first_;
  std::optional<CameraModel> camera_;
};

/// YAML of camera_calibration, or INI by its ending. Throws CameraError that begins with the path, also for a file that
/// is not calibrated.
CameraModel readCameraFile(const std::string& path);
/// `path` says whether it is YAML or INI.
CameraModel parseCameraFile(const std::string& content, const std::string& path);

/// By image_transport's naming: "/left/image_raw" and "/left/image_raw/compressed" to "/left/camera_info".
std::string cameraInfoTopic(const std::string& image_topic);

/// By image_proc's naming: "/left/image_rect", "/left/image_rect_color".
bool isRectified(const std::string& image_topic);

/// Standard deviation of a variance in a message; 0 for none, for what cannot be, and from 9999 on, by which drivers
/// say that they do not know.
double deviationOf(double variance_m2);

/// What the receiver cannot know, or claims without sense, is 0.
Fix toFix(const sensor_msgs::NavSatFix& message, std::int64_t stamp_ns);

/// Position and heading of `base_frame` in the plane of the odometry's frame. Throws std::invalid_argument, in words,
/// when a number is not finite, the orientation is no rotation, it is about another frame of the robot, or its own
/// frame is `map_frame`.
OdometryReading toReading(const nav_msgs::Odometry& message, std::int64_t stamp_ns, const std::string& base_frame,
                          const std::string& map_frame);

}  // namespace visual_localization
