#pragma once

#include <cstddef>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <string>

#include <geometry_msgs/TransformStamped.h>
#include <ros/callback_queue.h>
#include <ros/node_handle.h>
#include <ros/spinner.h>
#include <ros/subscriber.h>
#include <ros/time.h>
#include <tf2/LinearMath/Transform.h>
#include <tf2/buffer_core.h>
#include <tf2_msgs/TFMessage.h>

#include "node/throttled_log.h"

namespace visual_localization {

/// Where one frame of the robot is in another. Keeps only the transforms on the way between the two: a tf2 listener
/// keeps every frame for ever, and one stamp near the end of what a stamp can hold ends its process. Thread-safe.
class RobotTransforms {
 public:
  /// Both may have the slash that tf gave frames.
  RobotTransforms(const std::string& parent, const std::string& child, ThrottledLog& log);

  /// Leaves out what is no transform between two frames of a robot, and says so.
  void add(const tf2_msgs::TFMessage& message, bool is_static);
  /// Time has gone back.
  void forget();
  /// `stamp` 0: the newest.
  bool knows(const ros::Time& stamp) const;
  /// Throws tf2::TransformException.
  tf2::Transform lookUp(const ros::Time& stamp) const;
  std::size_t frames() const;

 private:
  void add(geometry_msgs::TransformStamped transform, bool is_static);
  void keep(const geometry_msgs::TransformStamped& transform, bool is_static);
  void findWay();

  const std::string parent_;
  const std::string child_;
  ThrottledLog& log_;
  mutable std::mutex mutex_;
  std::unique_ptr<tf2::BufferCore> buffer_;
  std::map<std::string, std::string> parents_;  ///< of the frames on the way
  std::set<std::string> way_;                   ///< the frames between the two, and above the upper one
  std::map<std::string, geometry_msgs::TransformStamped> statics_;  ///< of all frames: they are sent only once
};

/// Subscribes RobotTransforms to tf, with a thread of its own: whoever waits for a transform must not hold it up.
class RobotTransformListener {
 public:
  /// `added`: after each message.
  RobotTransformListener(ros::NodeHandle node, RobotTransforms& transforms, ThrottledLog& log,
                         const std::function<void()>& added);
  ~RobotTransformListener();
  RobotTransformListener(const RobotTransformListener&) = delete;
  RobotTransformListener& operator=(const RobotTransformListener&) = delete;

 private:
  ros::CallbackQueue queue_;
  ros::Subscriber moving_;
  ros::Subscriber static_;
  ros::AsyncSpinner spinner_;
};

}  // namespace visual_localization
