#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include <Eigen/Geometry>
#include <nav_msgs/Odometry.h>
#include <sensor_msgs/NavSatFix.h>
#include <tf2/buffer_core.h>
#include <tf2_msgs/TFMessage.h>

#include "visual_localization/geo/geodetic_point.h"
#include "visual_localization/localization/odometry.h"

namespace visual_localization {

/// A fix with the stamp given; what the receiver cannot know, or claims without sense, is 0.
Fix toFix(const sensor_msgs::NavSatFix& message, std::int64_t stamp_ns);

/// Position and heading of `base_frame` in the plane of the odometry's frame. Throws std::invalid_argument, in words,
/// when a number is not finite, the orientation is no rotation, it is about another frame of the robot, or its own
/// frame is `map_frame`: then it is no odometry, but what somebody has localised.
OdometryReading toReading(const nav_msgs::Odometry& message, std::int64_t stamp_ns, const std::string& base_frame,
                          const std::string& map_frame);

/// tf2 knows frames without the slash that tf gave them.
std::string withoutSlash(const std::string& frame);

/// Where the parts of a robot are that do not move, as /tf_static tells. Not thread-safe.
class StaticTransforms {
 public:
  /// Leaves out transforms that are not finite, whose rotation is not of unit length, or that name no two frames.
  void add(const tf2_msgs::TFMessage& message);
  /// The pose of `frame` in `base_frame`; nothing when they are not connected.
  std::optional<Eigen::Isometry3d> pose(const std::string& base_frame, const std::string& frame) const;

 private:
  tf2::BufferCore buffer_;
};

}  // namespace visual_localization
