#include "ros/message_readers.h"

#include <cmath>
#include <stdexcept>

#include <Eigen/Geometry>
#include <tf2/exceptions.h>
#include <tf2_eigen/tf2_eigen.h>

#include "base/text.h"

namespace visual_localization {
namespace {

/// Of a variance that the receiver claims; 0 when it claims none, or what cannot be.
double sigmaOf(const sensor_msgs::NavSatFix& message, double variance_m2) {
  if (message.position_covariance_type == sensor_msgs::NavSatFix::COVARIANCE_TYPE_UNKNOWN) return 0.0;
  return std::isfinite(variance_m2) && variance_m2 > 0.0 ? std::sqrt(variance_m2) : 0.0;
}

bool isRigid(const geometry_msgs::Transform& transform) {
  constexpr double kUnitTolerance = 1e-3;
  const Eigen::Quaterniond rotation(transform.rotation.w, transform.rotation.x, transform.rotation.y,
                                    transform.rotation.z);
  const Eigen::Vector3d translation(transform.translation.x, transform.translation.y, transform.translation.z);
  return translation.allFinite() && std::abs(rotation.norm() - 1.0) <= kUnitTolerance;
}

}  // namespace

Fix toFix(const sensor_msgs::NavSatFix& message, std::int64_t stamp_ns) {
  return {stamp_ns,
          {message.latitude, message.longitude, message.altitude},
          message.status.status >= sensor_msgs::NavSatStatus::STATUS_FIX,
          sigmaOf(message, 0.5 * (message.position_covariance[0] + message.position_covariance[4])),
          sigmaOf(message, message.position_covariance[8])};
}

std::string withoutSlash(const std::string& frame) {
  return !frame.empty() && frame.front() == '/' ? frame.substr(1) : frame;
}

void StaticTransforms::add(const tf2_msgs::TFMessage& message) {
  for (geometry_msgs::TransformStamped transform : message.transforms) {
    transform.header.frame_id = withoutSlash(transform.header.frame_id);
    transform.child_frame_id = withoutSlash(transform.child_frame_id);
    const bool named = !transform.header.frame_id.empty() && !transform.child_frame_id.empty() &&
                       transform.header.frame_id != transform.child_frame_id;
    if (named && isRigid(transform.transform)) buffer_.setTransform(transform, "tf_static", true);
  }
}

std::optional<Eigen::Isometry3d> StaticTransforms::pose(const std::string& base_frame, const std::string& frame) const {
  const std::string base = withoutSlash(base_frame);
  const std::string child = withoutSlash(frame);
  if (base.empty() || child.empty()) return std::nullopt;
  try {
    const Eigen::Isometry3d pose = tf2::transformToEigen(buffer_.lookupTransform(base, child, ros::Time()));
    return pose.matrix().allFinite() ? std::optional<Eigen::Isometry3d>(pose) : std::nullopt;
  } catch (const tf2::TransformException&) {
    return std::nullopt;
  }
}

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
