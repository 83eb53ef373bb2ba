#include "node/late_odometry.h"

#include <chrono>
#include <string>

#include <gtest/gtest.h>

namespace visual_localization {
namespace {

using std::chrono::milliseconds;

class LateOdometryTest : public testing::Test {
 protected:
  static void SetUpTestSuite() { ros::Time::init(); }

  void await(double stamp_s, milliseconds now = milliseconds(0)) {
    PoseEstimate pose;
    pose.position_m.x() = 10.0 * stamp_s;
    late_.await(pose, ros::Time(stamp_s), begin_ + now);
  }
  void move(double stamp_s) {
    geometry_msgs::TransformStamped transform;
    transform.header.frame_id = "odom";
    transform.header.stamp = ros::Time(stamp_s);
    transform.child_frame_id = "base_link";
    transform.transform.translation.x = stamp_s;
    transform.transform.rotation.w = 1.0;
    tf2_msgs::TFMessage message;
    message.transforms.push_back(transform);
    transforms_.add(message, false);
  }
  bool isMissingAfter(milliseconds wait) const { return late_.isMissing(begin_ + wait); }

  ThrottledLog log_{[](ThrottledLog::Severity, const std::string&) {}, milliseconds(0)};
  RobotTransforms transforms_{"odom", "base_link", log_};
  const std::chrono::steady_clock::time_point begin_{};
  LateOdometry late_;
};

TEST_F(LateOdometryTest, APoseWaitsUntilOdometryOfItsTimeIsThere) {
  await(5.0);
  EXPECT_FALSE(late_.take(transforms_));
  move(4.0);
  EXPECT_FALSE(late_.take(transforms_));
  move(6.0);
  const auto pose = late_.take(transforms_);
  ASSERT_TRUE(pose);
  EXPECT_EQ(pose->stamp, ros::Time(5.0));
  EXPECT_DOUBLE_EQ(pose->pose.position_m.x(), 50.0);
  EXPECT_NEAR(pose->base_in_odom.getOrigin().x(), 5.0, 1e-9);
  EXPECT_FALSE(late_.take(transforms_)) << "once";
}

TEST_F(LateOdometryTest, OfSeveralTheNewestCountsAndLaterOnesWait) {
  for (const double stamp_s : {1.0, 2.0, 3.0, 4.0}) await(stamp_s);
  move(0.5);
  move(3.5);
  ASSERT_EQ(late_.take(transforms_)->stamp, ros::Time(3.0));
  EXPECT_FALSE(late_.take(transforms_));
  move(4.0);
  EXPECT_EQ(late_.take(transforms_)->stamp, ros::Time(4.0));
}

// As slow as a wheel encoder behind a filter on a busy computer: always later than the next images.
TEST_F(LateOdometryTest, OdometryThatIsAlwaysLateMovesTheRobotAllTheSame) {
  constexpr int kImages = 1000;
  constexpr int kDelay_images = 20;
  move(0.0);
  int moved = 0;
  for (int image = 1; image <= kImages; ++image) {
    await(0.1 * image, milliseconds(10 * image));
    EXPECT_FALSE(isMissingAfter(milliseconds(10 * image)));
    if (image <= kDelay_images) continue;
    move(0.1 * (image - kDelay_images));
    moved += late_.take(transforms_).has_value() ? 1 : 0;
  }
  EXPECT_GE(moved, kImages - kDelay_images - 1);  // one may differ by rounding of stamps
}

TEST_F(LateOdometryTest, AfterHalfASecondItIsMissing) {
  EXPECT_FALSE(isMissingAfter(milliseconds(1000)));
  await(1.0);
  await(2.0, milliseconds(400));
  EXPECT_FALSE(isMissingAfter(milliseconds(500)));
  EXPECT_TRUE(isMissingAfter(milliseconds(501)));
  move(1.0);
  ASSERT_TRUE(late_.take(transforms_));
  EXPECT_FALSE(isMissingAfter(milliseconds(501)));
  EXPECT_TRUE(isMissingAfter(milliseconds(901)));
}

TEST_F(LateOdometryTest, WithoutOdometryOnlyTheLastPosesAreKept) {
  for (int image = 1; image <= 100; ++image) await(image);
  move(1.0);
  move(20.0);
  EXPECT_FALSE(late_.take(transforms_)) << "long forgotten";
  move(37.0);
  EXPECT_EQ(late_.take(transforms_)->stamp, ros::Time(37.0));
}

TEST_F(LateOdometryTest, WhenTimeGoesBackNoPoseIsLeft) {
  await(1.0);
  late_.clear();
  move(1.0);
  EXPECT_FALSE(late_.take(transforms_));
  EXPECT_FALSE(isMissingAfter(milliseconds(1000)));
}

}  // namespace
}  // namespace visual_localization
