// Poses that odometry contradicts: when they count as confirmed.

#include <cmath>
#include <cstdint>
#include <optional>

#include <gtest/gtest.h>

#include "base/numbers.h"
#include "test/localization/pose_verifier_fixture.h"
#include "visual_localization/localization/metric_pose.h"

namespace visual_localization {
namespace {

using test::kSecond_ns;

/// A robot that stands near training image 10, until somebody carries it.
class CarriedRobot : public test::PoseVerifierTest {
 protected:
  CarriedRobot() {
    verifier_.predictor().useOdometry(track_, config_);
    EXPECT_TRUE(verifyNear(0.0, 10));
    turnWheelsUntil(1.0, {0.0, 0.0});
    EXPECT_TRUE(confirmedAt(1.0, 10));
  }

  /// Odometry goes straight to a position, by its own reckoning, until this time.
  void turnWheelsUntil(double time_s, const Eigen::Vector2d& position_m, double yaw_rad = 0.0) {
    const OdometryReading begin = last_;
    const int readings = static_cast<int>(std::lround(10.0 * (time_s - begin_s_)));
    for (int k = 0; k <= readings; ++k) {
      const double share = static_cast<double>(k) / readings;
      last_.stamp_ns = static_cast<std::int64_t>((begin_s_ + 0.1 * k) * kSecond_ns);
      last_.position_m = begin.position_m + share * (position_m - begin.position_m);
      last_.yaw_rad = begin.yaw_rad + share * (yaw_rad - begin.yaw_rad);
      track_.add(last_);
    }
    begin_s_ = time_s;
  }
  /// Whether the pose of an image from beside training image `i` is confirmed.
  bool confirmedAt(double time_s, std::size_t i) {
    const std::optional<MetricPose> pose = verifyNear(time_s, i);
    EXPECT_TRUE(pose) << time_s;
    return pose && pose->confirmed;
  }

  OdometryConfig config_;
  OdometryTrack track_{config_};
  OdometryReading last_;
  double begin_s_ = 0.0;
};

TEST_F(CarriedRobot, IsConfirmedAtOnceWhereOdometryIsNotBelieved) {
  turnWheelsUntil(2.0, {4.0, 0.0});
  EXPECT_TRUE(confirmedAt(2.0, 10)) << "the wheels have slipped";
  turnWheelsUntil(3.0, {4.0, 0.0});
  EXPECT_TRUE(confirmedAt(3.0, 35));
}

TEST_F(CarriedRobot, IsConfirmedAfterTenPosesHoweverLongThatTakes) {
  double time_s = 2.0;
  for (int image = 0; image <= 10; ++image, time_s += 7.0) {  // longer than any velocity holds
    turnWheelsUntil(time_s, {0.0, 0.0});
    EXPECT_EQ(confirmedAt(time_s, 35), image == 10) << image;
  }
}

TEST_F(CarriedRobot, IsConfirmedAtOnceWhenNobodyKnowsHowItCameThere) {
  turnWheelsUntil(2.0, {0.0, 0.0});
  EXPECT_FALSE(confirmedAt(2.0, 35));
  EXPECT_TRUE(confirmedAt(9.0, 35)) << "without odometry for seven seconds";
}

// Its first velocity is that of being carried.
TEST_F(CarriedRobot, IsConfirmedByTenPosesAlongItsVelocity) {
  turnWheelsUntil(2.0, {0.0, 0.0});
  EXPECT_FALSE(confirmedAt(2.0, 35));
  for (int second = 3; second <= 13; ++second) EXPECT_EQ(confirmedAt(second, 35), second == 13) << second;
}

TEST_F(CarriedRobot, WasNotCarriedWhereAWrongHeadingExplainsIt) {
  config_.turn_sigma_rad_m = 0.03;
  verifier_.predictor().useOdometry(track_, config_);
  MetricConfig config;
  config.min_inliers = 10;  // few where odometry leads aside
  config.min_inliers_predicted = 10;
  config.min_inliers_tracking = 20;
  verifier_.configure(config);
  const std::optional<MetricPose> begin = verifyNear(1.0, 10);
  ASSERT_TRUE(begin);
  const CameraPose there = street_.mappedNear(25, kBeside_m);
  const Eigen::Vector2d way_m = there.position_m.head<2>() - begin->base.translation().head<2>();
  const double begin_yaw_rad = yawOf(begin->base);
  constexpr double kWrong_rad = 0.25;
  turnWheelsUntil(11.0, Eigen::Rotation2Dd(kWrong_rad - begin_yaw_rad) * way_m,
                  std::remainder(there.yaw_rad() - begin_yaw_rad, 2.0 * kPi));
  const double off_m = kWrong_rad * way_m.norm();
  ASSERT_GT(off_m, config.max_prediction_error_m + config_.distance_sigma * way_m.norm() + 0.2);
  EXPECT_TRUE(confirmedAt(11.0, 25));
}

}  // namespace
}  // namespace visual_localization
