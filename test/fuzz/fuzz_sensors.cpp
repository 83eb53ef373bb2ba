/// What sensors send beside images and calibrations: odometry, fixes and static transforms. The first byte chooses.
#include <cmath>
#include <cstdint>
#include <stdexcept>
#include <string>

#include <nav_msgs/Odometry.h>
#include <sensor_msgs/NavSatFix.h>
#include <tf2_msgs/TFMessage.h>

#include "bag/bag_messages.h"
#include "node/robot_transforms.h"
#include "ros/message_readers.h"
#include "ros/static_transforms.h"
#include "test/fuzz/fuzz_support.h"

namespace visual_localization {
namespace {

void readOdometry(const nav_msgs::Odometry& message) {
  fuzz::expect<std::invalid_argument>([&] {
    const OdometryReading reading = toReading(message, 1, "base_link", "map");
    if (!reading.position_m.allFinite()) fuzz::fail("odometry that is nowhere");
    fuzz::countRead();
  });
}

void readFix(const sensor_msgs::NavSatFix& message) {
  const Fix fix = toFix(message, 1);
  const GeodeticPoint& position = fix.position;
  if (hasPosition(fix) && !(std::abs(position.latitude_deg) <= 90.0 && std::abs(position.longitude_deg) <= 180.0)) {
    fuzz::fail("a fix beyond the earth");
  }
  if (!(fix.sigma_m >= 0.0) || !(fix.sigma_up_m >= 0.0)) fuzz::fail("a fix without a standard deviation");
  if (std::isinf(fix.sigma_m) || std::isinf(fix.sigma_up_m)) fuzz::fail("a fix that knows nothing");
  if (hasPosition(fix)) fuzz::countRead();
}

/// Those that move, whatever their stamps.
void readRobotTransforms(const tf2_msgs::TFMessage& message) {
  ros::Time::init();
  ThrottledLog log([](ThrottledLog::Severity, const std::string& text) { fuzz::requireOneLine(text); });
  RobotTransforms transforms("odom", "base_link", log);
  fuzz::mustNotThrow([&] {
    for (const bool is_static : {false, true, false}) transforms.add(message, is_static);
    for (const geometry_msgs::TransformStamped& transform : message.transforms)
      transforms.knows(transform.header.stamp);
    if (!transforms.knows(ros::Time())) return;
    const tf2::Vector3 origin = transforms.lookUp(ros::Time()).getOrigin();
    if (!std::isfinite(origin.length())) fuzz::fail("a robot that is nowhere");
    fuzz::countRead();
  });
  if (transforms.frames() > 2 * message.transforms.size()) fuzz::fail("frames that nobody sent");
}

void readTransforms(const tf2_msgs::TFMessage& message) {
  StaticTransforms transforms;
  transforms.addPublished(message);
  transforms.add(message);
  if (transforms.whyNone("base_link", "camera").find('\n') != std::string::npos) fuzz::fail("two lines");
  const auto pose = transforms.pose("base_link", "camera");
  if (pose && !pose->matrix().allFinite()) fuzz::fail("a camera that is nowhere");
  if (pose) fuzz::countRead();
  readRobotTransforms(message);
}

}  // namespace
}  // namespace visual_localization

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace visual_localization;
  if (size == 0) return 0;
  const std::string bytes = fuzz::Input(data + 1, size - 1).rest();
  fuzz::expect<ImageError>([&] {
    switch (data[0] % 3) {
      case 0:
        readOdometry(*deserialize<nav_msgs::Odometry>(bytes));
        break;
      case 1:
        readFix(*deserialize<sensor_msgs::NavSatFix>(bytes));
        break;
      default:
        readTransforms(*deserialize<tf2_msgs::TFMessage>(bytes));
    }
  });
  return 0;
}
