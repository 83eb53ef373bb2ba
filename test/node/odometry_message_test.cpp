#include <cmath>
#include <limits>
#include <stdexcept>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/numbers.h"
#include "ros/message_readers.h"
#include "test/support/refusal.h"

namespace visual_localization {
namespace {

using testing::HasSubstr;

nav_msgs::Odometry message() {
  nav_msgs::Odometry odometry;
  odometry.header.frame_id = "odom";
  odometry.child_frame_id = "base_link";
  odometry.pose.pose.position.x = 3.0;
  odometry.pose.pose.position.y = -4.0;
  odometry.pose.pose.orientation.z = std::sin(0.5);
  odometry.pose.pose.orientation.w = std::cos(0.5);
  return odometry;
}

std::string refusalOfOdometry(const nav_msgs::Odometry& odometry) {
  return test::refusalOf<std::invalid_argument>([&] { toReading(odometry, 1, "base_link", "map"); });
}

TEST(OdometryMessage, IsAPoseInThePlane) {
  const OdometryReading reading = toReading(message(), 7, "base_link", "map");
  EXPECT_EQ(reading.stamp_ns, 7);
  EXPECT_EQ(reading.position_m, Eigen::Vector2d(3.0, -4.0));
  EXPECT_NEAR(reading.yaw_rad, 1.0, 1e-12);
}

TEST(OdometryMessage, FramesMayHaveALeadingSlashAndTheRobotsMayBeMissing) {
  nav_msgs::Odometry odometry = message();
  odometry.child_frame_id = "/base_link";
  EXPECT_EQ(refusalOfOdometry(odometry), "accepted");
  odometry.child_frame_id = "";
  EXPECT_EQ(refusalOfOdometry(odometry), "accepted");
}

TEST(OdometryMessage, RefusesWhatIsNoOdometryOfTheRobot) {
  nav_msgs::Odometry odometry = message();
  odometry.child_frame_id = "left_wheel";
  EXPECT_THAT(refusalOfOdometry(odometry), HasSubstr("'left_wheel' instead of 'base_link'"));
  odometry = message();
  odometry.header.frame_id = "/map";
  EXPECT_THAT(refusalOfOdometry(odometry), HasSubstr("which is the map's"));
  for (double* value : {&odometry.pose.pose.position.x, &odometry.pose.pose.position.y,
                        &odometry.pose.pose.orientation.w, &odometry.pose.pose.orientation.x}) {
    odometry = message();
    *value = std::numeric_limits<double>::quiet_NaN();
    EXPECT_THAT(refusalOfOdometry(odometry), HasSubstr("not finite"));
  }
  odometry = message();
  odometry.pose.pose.orientation.w = odometry.pose.pose.orientation.z = 0.0;
  EXPECT_THAT(refusalOfOdometry(odometry), HasSubstr("no unit quaternion"));
}

}  // namespace
}  // namespace visual_localization
