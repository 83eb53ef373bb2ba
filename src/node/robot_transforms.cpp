#include "node/robot_transforms.h"

#include <stdexcept>
#include <utility>

#include <tf2_geometry_msgs/tf2_geometry_msgs.h>

#include "base/text.h"
#include "node/stamps.h"
#include "ros/static_transforms.h"

namespace visual_localization {
namespace {

constexpr std::uint32_t kQueue = 100;
/// tf2 never forgets a name: after so many it starts anew.
constexpr std::size_t kMostNames = 1000;

}  // namespace

RobotTransforms::RobotTransforms(const std::string& parent, const std::string& child, ThrottledLog& log)
    : parent_(withoutSlash(parent)), child_(withoutSlash(child)), log_(log), buffer_(new tf2::BufferCore) {
  findWay();
}

void RobotTransforms::add(const tf2_msgs::TFMessage& message, bool is_static) {
  for (const geometry_msgs::TransformStamped& transform : message.transforms) {
    try {
      add(transform, is_static);
    } catch (const std::exception& error) {
      log_.warn("tf", "Transform of " + oneLine(transform.child_frame_id, 100) + " left out: " + error.what());
    }
  }
}

void RobotTransforms::add(geometry_msgs::TransformStamped transform, bool is_static) {
  transform.header.frame_id = withoutSlash(transform.header.frame_id);
  transform.child_frame_id = withoutSlash(transform.child_frame_id);
  const std::lock_guard<std::mutex> lock(mutex_);
  const bool is_on_way = way_.count(transform.child_frame_id) != 0;
  if (!is_on_way && !is_static) return;
  if (!joinsTwoFrames(transform)) throw std::invalid_argument("it does not join two frames by a rigid motion");
  if (!isWithinReach(transform.transform)) throw std::invalid_argument("it is not finite, or leads farther than 1e9 m");
  if (!is_static) requireUsableStamp(transform.header.stamp);
  if (is_static) {
    if (statics_.size() >= kMostFrames && statics_.count(transform.child_frame_id) == 0) {
      throw std::invalid_argument("there are " + std::to_string(kMostFrames) + " static frames already");
    }
    statics_[transform.child_frame_id] = transform;
  }
  if (is_on_way) keep(transform, is_static);
}

/// The caller holds the mutex.
void RobotTransforms::keep(const geometry_msgs::TransformStamped& transform, bool is_static) {
  if (!buffer_->setTransform(transform, "tf", is_static)) return;  // not finite, no rotation, or old
  std::string& parent = parents_[transform.child_frame_id];
  if (parent == transform.header.frame_id) return;
  parent = transform.header.frame_id;
  findWay();
}

/// Up from both frames; a new parent may be a static frame that is known already.
void RobotTransforms::findWay() {
  std::set<std::string> way;
  for (const std::string* end : {&child_, &parent_}) {
    std::string frame = *end;
    while (way.size() < kMostFrames && way.insert(frame).second) {
      auto parent = parents_.find(frame);
      if (parent == parents_.end()) {
        const auto known = statics_.find(frame);
        if (known == statics_.end()) break;
        buffer_->setTransform(known->second, "tf", true);
        parent = parents_.emplace(frame, known->second.header.frame_id).first;
      }
      frame = parent->second;
    }
  }
  way_ = std::move(way);
  for (auto entry = parents_.begin(); entry != parents_.end();) {
    entry = way_.count(entry->first) != 0 ? std::next(entry) : parents_.erase(entry);
  }
  std::vector<std::string> names;
  buffer_->_getFrameStrings(names);
  if (names.size() <= kMostNames) return;
  buffer_ = std::make_unique<tf2::BufferCore>();
  parents_.clear();
}

void RobotTransforms::forget() {
  const std::lock_guard<std::mutex> lock(mutex_);
  buffer_->clear();
}

bool RobotTransforms::knows(const ros::Time& stamp) const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return buffer_->canTransform(parent_, child_, stamp);
}

tf2::Transform RobotTransforms::lookUp(const ros::Time& stamp) const {
  const std::lock_guard<std::mutex> lock(mutex_);
  tf2::Transform transform;
  tf2::fromMsg(buffer_->lookupTransform(parent_, child_, stamp).transform, transform);
  return transform;
}

std::size_t RobotTransforms::frames() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return parents_.size() + statics_.size();
}

RobotTransformListener::RobotTransformListener(ros::NodeHandle node, RobotTransforms& transforms, ThrottledLog& log,
                                               const std::function<void()>& added)
    : spinner_(1, &queue_) {
  node.setCallbackQueue(&queue_);
  const auto subscribe = [&](const char* topic, bool is_static) {
    const boost::function<void(const tf2_msgs::TFMessageConstPtr&)> add =
        [&transforms, &log, added, is_static](const tf2_msgs::TFMessageConstPtr& message) {
          guarded(log, "tf", [&] {
            transforms.add(*message, is_static);
            added();
          });
        };
    return node.subscribe<tf2_msgs::TFMessage>(topic, kQueue, add);
  };
  moving_ = subscribe("/tf", false);
  static_ = subscribe("/tf_static", true);
  spinner_.start();
}

RobotTransformListener::~RobotTransformListener() { spinner_.stop(); }

}  // namespace visual_localization
