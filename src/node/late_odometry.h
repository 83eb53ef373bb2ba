#pragma once

#include <chrono>
#include <deque>
#include <optional>

#include <ros/time.h>
#include <tf2/LinearMath/Transform.h>

#include "node/robot_transforms.h"
#include "visual_localization/localization/estimate.h"

namespace visual_localization {

/// Poses of images whose odometry has not come yet: on a loaded computer it may come after the pose.
class LateOdometry {
 public:
  struct Pose {
    PoseEstimate pose;
    ros::Time stamp;
    tf2::Transform base_in_odom;
  };

  /// `now`: for isMissing().
  void await(const PoseEstimate& pose, const ros::Time& stamp, std::chrono::steady_clock::time_point now);
  /// The newest pose whose odometry has come. It and those before it are awaited no longer.
  std::optional<Pose> take(const RobotTransforms& transforms);
  /// Whether a pose has waited for longer than odometry takes.
  bool isMissing(std::chrono::steady_clock::time_point now) const;
  void clear() { awaited_.clear(); }

 private:
  struct Awaited {
    PoseEstimate pose;
    ros::Time stamp;
    std::chrono::steady_clock::time_point since;
  };
  std::deque<Awaited> awaited_;  ///< the oldest first
};

}  // namespace visual_localization
