#include "ros/static_transforms.h"

#include <cmath>

#include <tf2/exceptions.h>
#include <tf2_eigen/tf2_eigen.h>

namespace visual_localization {
namespace {

bool isRigid(const geometry_msgs::Transform& transform) {
  constexpr double kUnitTolerance = 1e-3;
  const Eigen::Quaterniond rotation(transform.rotation.w, transform.rotation.x, transform.rotation.y,
                                    transform.rotation.z);
  const Eigen::Vector3d translation(transform.translation.x, transform.translation.y, transform.translation.z);
  return translation.allFinite() && std::abs(rotation.norm() - 1.0) <= kUnitTolerance;
}

}  // namespace

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

}  // namespace visual_localization
