#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <set>
#include <string>

#include <Eigen/Geometry>
#include <geometry_msgs/TransformStamped.h>
#include <tf2_msgs/TFMessage.h>

#include "visual_localization/geometry/camera_pose.h"

namespace visual_localization {

/// tf2 knows frames without the slash that tf gave them.
std::string withoutSlash(const std::string& frame);

/// A robot has tens or hundreds; frames beyond are left out: whoever publishes them may never end.
constexpr std::size_t kMostFrames = 4096;

/// By names of a length that names have.
bool joinsTwoFrames(const geometry_msgs::TransformStamped& transform);

/// Finite, and no farther than a robot's frames can be.
bool isWithinReach(const geometry_msgs::Transform& transform);

/// What does not move on a robot, by /tf_static and by what never changes in /tf. Unlike a buffer of tf2 it knows why a
/// frame has no place: nothing that contradicts itself is believed. Not thread-safe.
class StaticTransforms {
 public:
  void add(const tf2_msgs::TFMessage& message);
  /// Fixed until it changes, and only where /tf_static says nothing.
  void addPublished(const tf2_msgs::TFMessage& message);

  /// Of `frame` in `base_frame`; nothing when they are not connected by fixed transforms.
  std::optional<Eigen::Isometry3d> pose(const std::string& base_frame, const std::string& frame) const;
  /// In words that name both frames and those that there are.
  std::string whyNone(const std::string& base_frame, const std::string& frame) const;
  bool knows(const std::string& frame) const;
  bool hasStatic() const { return has_static_; }

 private:
  struct Link {
    std::string parent;
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();  ///< child_in_parent
    bool is_static = false;
    std::string trouble = {};  ///< why it is not believed; empty: it is
  };
  void add(const tf2_msgs::TFMessage& message, bool is_static);
  bool isFull(const std::string& parent, const std::string& child);
  std::optional<Eigen::Isometry3d> toRoot(std::string frame, std::string& root) const;
  std::string troubleAbove(const std::string& frame) const;

  std::map<std::string, Link> links_;  ///< by child
  std::set<std::string> names_;
  bool has_static_ = false;
};

/// Where a robot carries camera and antenna by its frames, and how that was found, for people.
struct RobotMount {
  SensorMount mount;
  std::string said;
};

/// Nothing when there is nothing that could tell. `antenna_frame`: none when only the camera is asked for. Throws
/// MountError that names the frames when they cannot tell.
std::optional<RobotMount> robotMount(const StaticTransforms& transforms, const std::string& base_frame,
                                     const std::string& image_frame, const std::optional<std::string>& antenna_frame);

}  // namespace visual_localization
