#include "node/driven_path.h"

#include <cmath>

#include "node/message_conversions.h"

namespace visual_localization {
namespace {

double distanceOf(const geometry_msgs::Point& a, const geometry_msgs::Point& b) {
  return std::hypot(a.x - b.x, a.y - b.y, a.z - b.z);
}

}  // namespace

void DrivenPath::add(const Estimate& estimate, const std_msgs::Header& header) {
  if (estimate.state != LocalizationState::kTracking || estimate.images_since_metric > 0) return;
  geometry_msgs::PoseStamped pose;
  pose.header = header;
  pose.pose = toPose(estimate, header).pose.pose;
  if (!poses_.empty() && distanceOf(pose.pose.position, poses_.back().pose.position) < kStep_m) return;
  poses_.push_back(pose);
  if (poses_.size() > kMost) poses_.pop_front();
}

nav_msgs::Path DrivenPath::toPath(const std_msgs::Header& header) const {
  nav_msgs::Path path;
  path.header = header;
  path.poses.assign(poses_.begin(), poses_.end());
  return path;
}

}  // namespace visual_localization
