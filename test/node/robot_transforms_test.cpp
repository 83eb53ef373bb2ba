#include "node/robot_transforms.h"

#include <chrono>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tf2/exceptions.h>

#include "node/stamps.h"
#include "ros/static_transforms.h"

namespace visual_localization {
namespace {

geometry_msgs::TransformStamped ahead(const std::string& parent, const std::string& child, double x_m,
                                      const ros::Time& stamp) {
  geometry_msgs::TransformStamped transform;
  transform.header.frame_id = parent;
  transform.header.stamp = stamp;
  transform.child_frame_id = child;
  transform.transform.translation.x = x_m;
  transform.transform.rotation.w = 1.0;
  return transform;
}

tf2_msgs::TFMessage messageOf(const geometry_msgs::TransformStamped& transform) {
  tf2_msgs::TFMessage message;
  message.transforms.push_back(transform);
  return message;
}

class RobotTransformsTest : public testing::Test {
 protected:
  static void SetUpTestSuite() { ros::Time::init(); }

  void move(const std::string& parent, const std::string& child, double x_m, const ros::Time& stamp) {
    transforms_.add(messageOf(ahead(parent, child, x_m, stamp)), false);
  }
  void fix(const std::string& parent, const std::string& child, double x_m) {
    transforms_.add(messageOf(ahead(parent, child, x_m, ros::Time())), true);
  }

  std::vector<std::string> lines_;
  ThrottledLog log_{[this](ThrottledLog::Severity, const std::string& text) { lines_.push_back(text); },
                    std::chrono::milliseconds(0)};
  RobotTransforms transforms_{"odom", "/base_link", log_};
  const ros::Time now_ = ros::Time::now();
};

TEST_F(RobotTransformsTest, FollowsAWayOfMovingAndStaticFramesInAnyOrder) {
  fix("odom", "platform", 1.0);
  fix("body", "base_link", 10.0);
  EXPECT_FALSE(transforms_.knows(now_));
  move("/platform", "/body", 100.0, now_);
  ASSERT_TRUE(transforms_.knows(now_));
  EXPECT_DOUBLE_EQ(transforms_.lookUp(now_).getOrigin().x(), 111.0);
  EXPECT_TRUE(lines_.empty());
}

TEST_F(RobotTransformsTest, AWayDownwardsIsFoundToo) {
  move("base_link", "odom", -7.0, now_);  // as robot_pose_ekf is set up by some
  ASSERT_TRUE(transforms_.knows(now_));
  EXPECT_DOUBLE_EQ(transforms_.lookUp(now_).getOrigin().x(), 7.0);
}

TEST_F(RobotTransformsTest, BetweenTwoStampsItInterpolates) {
  move("odom", "base_link", 1.0, now_);
  move("odom", "base_link", 2.0, now_ + ros::Duration(1.0));
  EXPECT_NEAR(transforms_.lookUp(now_ + ros::Duration(0.25)).getOrigin().x(), 1.25, 1e-9);
  EXPECT_FALSE(transforms_.knows(now_ + ros::Duration(1.5)));
  transforms_.forget();
  EXPECT_FALSE(transforms_.knows(now_));
}

TEST_F(RobotTransformsTest, FramesOfOthersAreNotKept) {
  move("odom", "base_link", 1.0, now_);
  for (int i = 0; i < 20000; ++i) move("odom", "stranger" + std::to_string(i), 1.0, now_);
  EXPECT_EQ(transforms_.frames(), 1U);
  for (int i = 0; i < 20000; ++i) fix("odom", "stranger" + std::to_string(i), 1.0);
  EXPECT_EQ(transforms_.frames(), kMostFrames + 1);
  EXPECT_THAT(lines_.front(), testing::HasSubstr("4096 static frames already"));
  EXPECT_TRUE(transforms_.knows(now_));
}

TEST_F(RobotTransformsTest, AParentThatChangesForEverTakesNoMoreMemory) {
  fix("odom", "platform", 1.0);
  for (int i = 0; i < 5000; ++i) move("stranger" + std::to_string(i), "base_link", 1.0, now_ + ros::Duration(1e-3 * i));
  EXPECT_LE(transforms_.frames(), 3U);
  const ros::Time later = now_ + ros::Duration(10.0);
  move("platform", "base_link", 2.0, later);
  ASSERT_TRUE(transforms_.knows(later));
  EXPECT_DOUBLE_EQ(transforms_.lookUp(later).getOrigin().x(), 3.0);
}

TEST_F(RobotTransformsTest, AStampNearTheEndOfTimeIsLeftOut) {
  move("odom", "base_link", 1.0, now_);
  for (const std::uint32_t before_end_s : {0U, 1U, 9U, 11U, 3600U, 100000U}) {
    move("odom", "base_link", 9.0, ros::Time(ros::TIME_MAX.sec - before_end_s, 999999999));
  }
  EXPECT_EQ(lines_.size(), 6U);
  EXPECT_THAT(lines_.front(), testing::AllOf(testing::HasSubstr("base_link"), testing::HasSubstr("4294967295")));
  move("odom", "base_link", 2.0, now_ + ros::Duration(1.0));
  EXPECT_NEAR(transforms_.lookUp(now_ + ros::Duration(0.5)).getOrigin().x(), 1.5, 1e-9);
  EXPECT_FALSE(transforms_.knows(ros::TIME_MAX));
}

TEST_F(RobotTransformsTest, WhatIsNoTransformIsLeftOut) {
  for (const double x_m : {std::nan(""), HUGE_VAL, 1e185, -2e9}) {
    move("odom", "base_link", x_m, now_);
    fix("odom", "base_link", x_m);
    EXPECT_THAT(lines_.back(), testing::HasSubstr("1e9 m")) << x_m;
  }
  move("base_link", "base_link", 1.0, now_);
  move("", "base_link", 1.0, now_);
  move(std::string(1000, 'x'), "base_link", 1.0, now_);
  EXPECT_FALSE(transforms_.knows(ros::Time()));
  EXPECT_EQ(transforms_.frames(), 0U);
  EXPECT_THROW(transforms_.lookUp(now_), tf2::TransformException);
}

TEST(StaticTransforms, KeepsNoMoreFramesThanARobotCanHave) {
  StaticTransforms transforms;
  const auto add = [&transforms](const std::string& parent, const std::string& child) {
    transforms.add(messageOf(ahead(parent, child, 1.0, ros::Time())));
  };
  add("base_link", "camera");
  for (int i = 0; i < 10000; ++i) add("base_link", "stranger" + std::to_string(i));
  for (int i = 0; i < 10000; ++i) add("parent" + std::to_string(i), "stranger0");
  EXPECT_TRUE(transforms.pose("base_link", "camera"));
  EXPECT_TRUE(transforms.pose("base_link", "stranger4093"));
  EXPECT_FALSE(transforms.pose("base_link", "stranger4094"));
}

TEST(Stamps, AreUsableUntilADayAfterTheLaterClock) {
  const ros::Time now(1000, 0);
  const ros::Time wall_now(1'800'000'000, 0);
  EXPECT_EQ(latestStamp(now, wall_now), ros::Time(1'800'086'400, 0));
  EXPECT_EQ(latestStamp(ros::Time(4'200'000'000, 0), wall_now), ros::Time(4'200'086'400, 0)) << "simulated";
  for (const ros::Time& end : {ros::TIME_MAX, ros::Time(ros::TIME_MAX.sec - 100, 0)}) {
    EXPECT_LE(latestStamp(end, wall_now), ros::Time(ros::TIME_MAX.sec - 86400, 0)) << "nobody's sum may overflow";
  }
}

TEST(Stamps, OldOnesAreUsable) {
  ros::Time::init();
  EXPECT_EQ(stampTrouble(ros::Time()), "");
  EXPECT_EQ(stampTrouble(ros::Time(1, 0)), "");
  EXPECT_EQ(stampTrouble(ros::Time::now() + ros::Duration(80000.0)), "");
  EXPECT_THAT(stampTrouble(ros::Time(4294967000U, 5)), testing::HasSubstr("4294967000.000000005 s"));
  EXPECT_THROW(requireUsableStamp(ros::TIME_MAX), std::invalid_argument);
}

TEST(Stamps, ASumEndsWithTheLatest) {
  EXPECT_EQ(later(ros::Time(5, 0), 0.5), ros::Time(5, 500000000));
  EXPECT_EQ(later(ros::TIME_MAX, 0.5), ros::TIME_MAX);
  EXPECT_EQ(later(ros::Time(5, 0), 1e12), ros::TIME_MAX);
}

TEST(Guarded, AnExceptionGoesIntoTheLog) {
  std::vector<std::string> lines;
  ThrottledLog log([&lines](ThrottledLog::Severity, const std::string& text) { lines.push_back(text); });
  guarded(log, "diagnostics", [] { return ros::TIME_MAX + ros::Duration(1.0); });
  ASSERT_EQ(lines.size(), 1U);
  EXPECT_THAT(lines.front(), testing::StartsWith("diagnostics: "));
}

}  // namespace
}  // namespace visual_localization
