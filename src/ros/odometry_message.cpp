#include "ros/odometry_message.h"

#include <cmath>
#include <stdexcept>

#include <Eigen/Geometry>

#include "base/text.h"
#include "ros/static_transforms.h"

namespace visual_localization {

OdometryReading toReading(const nav_msgs::Odometry& message, std::int64_t stamp_ns, const std::string& base_frame,
                          const std::string& map_frame) {
  constexpr double kRounding = 0.01;
  const auto& p = message.pose.pose.position;
  const auto& q = message.pose.pose.orientation;
  const Eigen::Quaterniond rotation(q.w, q.x, q.y, q.z);
  if (!std::isfinite(p.x) || !std::isfinite(p.y) || !rotation.coeffs().allFinite()) {
    throw std::invalid_argument("its pose is not finite");
  }
  if (std::abs(rotation.norm() - 1.0) > kRounding) throw std::invalid_argument("its orientation is no unit quaternion");
  const std::string child = withoutSlash(message.child_frame_id);
  if (!child.empty() && child != base_frame) {
    throw std::invalid_argument("its child_frame_id is '" + oneLine(child, 100) + "' instead of '" + base_frame + "'");
  }
  if (withoutSlash(message.header.frame_id) == map_frame) {
    throw std::invalid_argument("its frame_id is '" + map_frame + "', which is the map's");
  }
  const Eigen::Vector3d ahead = rotation * Eigen::Vector3d::UnitX();
  return {stamp_ns, {p.x, p.y}, std::atan2(ahead.y(), ahead.x())};
}

}  // namespace visual_localization
