/// What sensors send beside images and calibrations: odometry, fixes, static transforms, and stamps. The first byte
/// chooses.
#include <cmath>
#include <cstdint>
#include <stdexcept>
#include <string>

#include <nav_msgs/Odometry.h>
#include <sensor_msgs/NavSatFix.h>
#include <tf2_msgs/TFMessage.h>

#include "bag/bag_messages.h"
#include "node/image_worker.h"
#include "node/robot_transforms.h"
#include "node/stamps.h"
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

/// What is passed on must not end a tf2 listener, which adds its time of waiting to it. Half a minute is more than any.
void readStamp(const ros::Time& stamp, double tolerance_s) {
  const std::string trouble = stampTrouble(stamp);
  if (!trouble.empty()) return fuzz::requireOneLine(trouble);
  fuzz::mustNotThrow([&] {
    const ros::Time passed_on = later(stamp, tolerance_s);
    if (passed_on < stamp) fuzz::fail("a stamp before the image");
    if (passed_on.nsec >= 1'000'000'000) fuzz::fail("a stamp with more nanoseconds than a second has");
    passed_on + ros::Duration(30.0);
  });
  fuzz::countRead();
}

/// In the order of the bytes.
void readStamps(fuzz::Input input) {
  constexpr double kLongestTolerance_s = 60.0;
  ros::Time::init();
  const double tolerance_s = kLongestTolerance_s * input.number<std::uint8_t>() / 255.0;
  StampMonitor monitor;
  auto before = StampMonitor::Verdict::kInOrder;
  while (!input.isEmpty()) {
    ros::Time stamp;
    stamp.sec = input.number<std::uint32_t>();
    stamp.nsec = input.number<std::uint32_t>();
    readStamp(stamp, tolerance_s);
    const StampMonitor::Verdict verdict = monitor.judge(static_cast<std::int64_t>(stamp.toNSec()));
    if (!(monitor.lag_s() >= 0.0)) fuzz::fail("an image ahead of itself");
    if ((verdict == StampMonitor::Verdict::kInOrder) != (monitor.lag_s() == 0.0)) fuzz::fail("late without a lag");
    if (verdict == StampMonitor::Verdict::kWentBack && before != StampMonitor::Verdict::kLate) {
      fuzz::fail("one image moves the time");
    }
    before = verdict;
  }
}

}  // namespace
}  // namespace visual_localization

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace visual_localization;
  if (size == 0) return 0;
  const std::string bytes = fuzz::Input(data + 1, size - 1).rest();
  fuzz::expect<ImageError>([&] {
    switch (data[0] % 4) {
      case 0:
        readOdometry(*deserialize<nav_msgs::Odometry>(bytes));
        break;
      case 1:
        readFix(*deserialize<sensor_msgs::NavSatFix>(bytes));
        break;
      case 2:
        readTransforms(*deserialize<tf2_msgs::TFMessage>(bytes));
        break;
      default:
        readStamps({data + 1, size - 1});
    }
  });
  return 0;
}
