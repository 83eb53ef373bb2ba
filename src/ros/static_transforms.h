#pragma once

#include <optional>
#include <string>

#include <Eigen/Geometry>
#include <tf2/buffer_core.h>
#include <tf2_msgs/TFMessage.h>

namespace visual_localization {

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
