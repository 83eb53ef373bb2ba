#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <set>
#include <string>

#include <nav_msgs/Odometry.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/NavSatFix.h>

#include "ros/static_transforms.h"
#include "visual_localization/camera/camera_model.h"
#include "visual_localization/geo/trajectory.h"
#include "visual_localization/localization/odometry.h"

namespace visual_localization {

/// The camera that a message describes, for images as they are sent: a region of interest is cut out and binned pixels
/// are larger. Nothing when the camera is not calibrated: its K is all zeros. `rectified`: the images are those of
/// image_proc, so P holds instead of K and there is no distortion. Throws CameraError when the calibration cannot be
/// used.
std::optional<CameraModel> toCamera(const sensor_msgs::CameraInfo& info, bool rectified = false);

/// Inverse of toCamera(), for images that are not rectified; its header is empty.
sensor_msgs::CameraInfo toMessage(const CameraModel& camera);

/// Whether its matrix says anything: that of a camera that nobody has calibrated is all zeros.
bool isCalibrated(const sensor_msgs::CameraInfo& info, bool rectified = false);

/// Whether two messages say the same but for rounding, whatever their headers.
bool sameCalibration(const sensor_msgs::CameraInfo& a, const sensor_msgs::CameraInfo& b);

/// What many messages of a recording say together: of the camera of all its images. Those that are not calibrated, as
/// before a driver has read its file or of a second publisher, do not count.
class SingleCalibration {
 public:
  explicit SingleCalibration(bool rectified) : rectified_(rectified) {}

  /// False when it says another thing than the first one that is calibrated. Throws CameraError when that cannot be
  /// used.
  bool add(const sensor_msgs::CameraInfo& info);
  /// Nothing while none is calibrated.
  const std::optional<CameraModel>& camera() const { return camera_; }

 private:
  bool rectified_;
  std::optional<sensor_msgs::CameraInfo> first_;
  std::optional<CameraModel> camera_;
};

/// Reads a file of camera_calibration: YAML, or INI by its ending. Throws CameraError that begins with the path, also
/// for a file that says the camera is not calibrated.
CameraModel readCameraFile(const std::string& path);
/// The same for its content; `path` still says whether it is YAML or INI.
CameraModel parseCameraFile(const std::string& content, const std::string& path);

/// Where a camera publishes its calibration by image_transport's naming: "/left/image_raw" and
/// "/left/image_raw/compressed" to "/left/camera_info".
std::string cameraInfoTopic(const std::string& image_topic);

/// Whether images of this topic are rectified, by image_proc's naming: "/left/image_rect", "/left/image_rect_color".
bool isRectified(const std::string& image_topic);

/// A fix with the stamp given; what the receiver cannot know, or claims without sense, is 0.
Fix toFix(const sensor_msgs::NavSatFix& message, std::int64_t stamp_ns);

/// Position and heading of `base_frame` in the plane of the odometry's frame. Throws std::invalid_argument, in words,
/// when a number is not finite, the orientation is no rotation, it is about another frame of the robot, or its own
/// frame is `map_frame`: then it is no odometry, but what somebody has localised.
OdometryReading toReading(const nav_msgs::Odometry& message, std::int64_t stamp_ns, const std::string& base_frame,
                          const std::string& map_frame);

}  // namespace visual_localization
