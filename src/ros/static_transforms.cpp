#include "ros/static_transforms.h"

#include <cmath>
#include <set>

#include "base/numbers.h"
#include "base/text.h"

namespace visual_localization {
namespace {

constexpr double kUnitTolerance = 1e-3;

std::string framed(const std::string& frame) { return frame.empty() ? "'' (empty)" : "'" + oneLine(frame) + "'"; }

Eigen::Quaterniond rotationOf(const geometry_msgs::Transform& transform) {
  return {transform.rotation.w, transform.rotation.x, transform.rotation.y, transform.rotation.z};
}

/// Empty when it is rigid.
std::string troubleOf(const geometry_msgs::Transform& transform) {
  const Eigen::Vector3d translation(transform.translation.x, transform.translation.y, transform.translation.z);
  const double norm = rotationOf(transform).norm();
  if (!translation.allFinite() || !std::isfinite(norm)) return "is not finite";
  if (!isWithinReach(transform)) return "leads farther than 1e9 m";
  if (norm == 0.0) return "has a quaternion of zeros";
  if (std::abs(norm - 1.0) > kUnitTolerance) return "has a quaternion that is not of unit length";
  return "";
}

Eigen::Isometry3d isometryOf(const geometry_msgs::Transform& transform) {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() = rotationOf(transform).normalized().toRotationMatrix();
  pose.translation() = Eigen::Vector3d(transform.translation.x, transform.translation.y, transform.translation.z);
  return pose;
}

/// But for rounding.
bool same(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b) {
  constexpr double kRounding = 1e-4;  // metres, and elements of a rotation
  return (a.matrix() - b.matrix()).cwiseAbs().maxCoeff() < kRounding;
}

}  // namespace

bool isWithinReach(const geometry_msgs::Transform& transform) {
  constexpr double kFarthest_m = 1e9;  // farther than any frame of a robot on the earth, and sums of it stay finite
  const auto isNear = [](double metres) { return std::abs(metres) <= kFarthest_m; };
  return isNear(transform.translation.x) && isNear(transform.translation.y) && isNear(transform.translation.z);
}

std::string withoutSlash(const std::string& frame) {
  return !frame.empty() && frame.front() == '/' ? frame.substr(1) : frame;
}

bool joinsTwoFrames(const geometry_msgs::TransformStamped& transform) {
  constexpr std::size_t kLongestName = 255;
  const std::string& parent = transform.header.frame_id;
  const std::string& child = transform.child_frame_id;
  return !parent.empty() && !child.empty() && parent != child && parent.size() <= kLongestName &&
         child.size() <= kLongestName;
}

bool StaticTransforms::isFull(const std::string& parent, const std::string& child) {
  for (const std::string& name : {parent, child}) {
    if (names_.count(name) != 0) continue;
    if (names_.size() >= kMostFrames) return true;
    names_.insert(name);
  }
  return false;
}

void StaticTransforms::add(const tf2_msgs::TFMessage& message) { add(message, true); }

void StaticTransforms::addPublished(const tf2_msgs::TFMessage& message) { add(message, false); }

void StaticTransforms::add(const tf2_msgs::TFMessage& message, bool is_static) {
  for (geometry_msgs::TransformStamped transform : message.transforms) {
    const std::string parent = transform.header.frame_id = withoutSlash(transform.header.frame_id);
    const std::string child = transform.child_frame_id = withoutSlash(transform.child_frame_id);
    if (!joinsTwoFrames(transform) || isFull(parent, child)) continue;
    has_static_ = has_static_ || is_static;
    const std::string name = framed(parent) + " to " + framed(child);
    std::string trouble = troubleOf(transform.transform);
    if (!trouble.empty()) trouble = name + " " + trouble;
    const Link link{parent, trouble.empty() ? isometryOf(transform.transform) : Eigen::Isometry3d::Identity(),
                    is_static, trouble};
    const auto [known, is_new] = links_.emplace(child, link);
    Link& before = known->second;
    if (is_new || (before.is_static && !is_static)) continue;
    if ((is_static && !before.is_static) || (!before.trouble.empty() && trouble.empty() && is_static)) {
      if (before.trouble.find("has two values") == std::string::npos) before = link;
      continue;
    }
    if (!trouble.empty() || (before.parent == parent && same(before.pose, link.pose))) continue;
    before.trouble = is_static ? framed(child) + " has two values in /tf_static, in " + framed(before.parent) +
                                     " and in " + framed(parent)
                               : name + " moves";
    if (is_static && before.parent == parent) before.trouble = name + " has two values in /tf_static";
  }
}

/// In the highest frame that fixed transforms lead to.
std::optional<Eigen::Isometry3d> StaticTransforms::toRoot(std::string frame, std::string& root) const {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  for (std::size_t steps = 0; steps <= links_.size(); ++steps) {
    const auto link = links_.find(frame);
    if (link == links_.end() || !link->second.trouble.empty()) {
      root = frame;
      return pose.matrix().allFinite() ? std::optional<Eigen::Isometry3d>(pose) : std::nullopt;
    }
    pose = link->second.pose * pose;
    frame = link->second.parent;
  }
  return std::nullopt;  // a circle
}

std::optional<Eigen::Isometry3d> StaticTransforms::pose(const std::string& base_frame, const std::string& frame) const {
  const std::string base = withoutSlash(base_frame);
  const std::string child = withoutSlash(frame);
  if (base.empty() || child.empty()) return std::nullopt;
  std::string base_root;
  std::string child_root;
  const auto base_pose = toRoot(base, base_root);
  const auto child_pose = toRoot(child, child_root);
  if (!base_pose || !child_pose || base_root != child_root) return std::nullopt;
  const Eigen::Isometry3d pose = base_pose->inverse() * *child_pose;
  return pose.matrix().allFinite() ? std::optional<Eigen::Isometry3d>(pose) : std::nullopt;
}

/// What ends the way upwards; empty when it is only that nobody says more.
std::string StaticTransforms::troubleAbove(const std::string& frame) const {
  std::string root;
  if (!toRoot(frame, root)) return "the frames above " + framed(frame) + " make a circle";
  const auto link = links_.find(root);
  return link == links_.end() ? "" : link->second.trouble;
}

std::string StaticTransforms::whyNone(const std::string& base_frame, const std::string& frame) const {
  constexpr std::size_t kMostNamed = 12;
  std::set<std::string> frames;
  for (const auto& [child, link] : links_) frames.insert({child, link.parent});
  std::string named;
  std::size_t count = 0;
  for (const std::string& one : frames) {
    if (++count <= kMostNamed) named += (named.empty() ? "" : ", ") + oneLine(one, 60);
  }
  if (count > kMostNamed) named += " and " + std::to_string(count - kMostNamed) + " more";
  std::string trouble = troubleAbove(withoutSlash(frame));
  if (trouble.empty()) trouble = troubleAbove(withoutSlash(base_frame));
  return "no way from " + framed(base_frame) + " to " + framed(frame) + (trouble.empty() ? "" : ", since " + trouble) +
         "; frames that there are: " + (named.empty() ? "none" : named);
}

bool StaticTransforms::knows(const std::string& frame) const {
  const std::string name = withoutSlash(frame);
  for (const auto& [child, link] : links_) {
    const bool moves = !link.is_static && !link.trouble.empty();
    if (!moves && (child == name || link.parent == name)) return true;
  }
  return false;
}

namespace {

/// REP 105 has base_link; many robots have only its projection to the ground.
std::string baseOf(const StaticTransforms& transforms, const std::string& wanted) {
  const std::string alias = "base_footprint";
  return !transforms.knows(wanted) && withoutSlash(wanted) == "base_link" && transforms.knows(alias) ? alias : wanted;
}

/// Images are in an optical frame (z ahead). In one of a body (x ahead) the camera would look at the sky.
bool looksUp(const Eigen::Isometry3d& camera) {
  constexpr double kSteep = 0.8;  // sine: beyond 53 degrees
  return camera.linear()(2, 2) > kSteep;
}

}  // namespace

std::optional<RobotMount> robotMount(const StaticTransforms& transforms, const std::string& base_frame,
                                     const std::string& image_frame, const std::optional<std::string>& antenna_frame) {
  const bool concerned = transforms.hasStatic() || transforms.knows(base_frame) || transforms.knows(image_frame) ||
                         (antenna_frame && transforms.knows(*antenna_frame));
  if (!concerned) return std::nullopt;
  const std::string base = baseOf(transforms, base_frame);
  const auto camera = transforms.pose(base, image_frame);
  if (!camera) {
    throw MountError("the images' frame: " + transforms.whyNone(base, image_frame) +
                     ": name the robot's frame (robot/base_frame), or say where the camera is (robot/camera)");
  }
  RobotMount found;
  found.said = "camera by frames " + framed(base) + " to " + framed(image_frame);
  Eigen::Quaterniond rotation(camera->linear());
  if (looksUp(*camera)) {
    rotation = rotation * levelCamera(0.0);
    found.said += ", taken for one of a body (x ahead), since an optical one (z ahead) would look up";
  }
  found.mount.camera = {rotation.normalized(), camera->translation()};
  found.mount.antenna_m = camera->translation();
  if (antenna_frame) {
    const auto antenna = transforms.pose(base, *antenna_frame);
    if (!antenna) {
      throw MountError("the fixes' frame: " + transforms.whyNone(base, *antenna_frame) +
                       ": say where the antenna is (robot/antenna)");
    }
    found.mount.antenna_m = antenna->translation();
    found.said += ", antenna " + framed(*antenna_frame);
  }
  requireMount(found.mount);
  return found;
}

}  // namespace visual_localization
