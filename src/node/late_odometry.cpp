#include "node/late_odometry.h"

#include <algorithm>
#include <cstddef>

#include <tf2/exceptions.h>

namespace visual_localization {
namespace {

/// At 30 images a second the delay of two seconds. Odometry that is later still moves the robot once the images pause.
constexpr std::size_t kMostAwaited = 64;
/// Wall time: simulated time may stand still.
constexpr std::chrono::milliseconds kLongestDelay{500};

}  // namespace

void LateOdometry::await(const PoseEstimate& pose, const ros::Time& stamp, std::chrono::steady_clock::time_point now) {
  if (awaited_.size() == kMostAwaited) awaited_.pop_front();
  awaited_.push_back({pose, stamp, now});
}

std::optional<LateOdometry::Pose> LateOdometry::take(const RobotTransforms& transforms) {
  const auto newest = std::find_if(awaited_.rbegin(), awaited_.rend(),
                                   [&transforms](const Awaited& awaited) { return transforms.knows(awaited.stamp); });
  if (newest == awaited_.rend()) return std::nullopt;
  try {
    const Pose pose{newest->pose, newest->stamp, transforms.lookUp(newest->stamp)};
    awaited_.erase(awaited_.begin(), newest.base());
    return pose;
  } catch (const tf2::TransformException&) {  // time has gone back since
    return std::nullopt;
  }
}

bool LateOdometry::isMissing(std::chrono::steady_clock::time_point now) const {
  return !awaited_.empty() && now - awaited_.front().since > kLongestDelay;
}

}  // namespace visual_localization
