#include "visual_localization/localization/odometry.h"

#include <cmath>
#include <limits>
#include <stdexcept>

#include <gtest/gtest.h>

#include "base/numbers.h"
#include "test/support/stamps.h"

namespace visual_localization {
namespace {

using test::kSecond_ns;
using test::ns;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

class Odometry : public testing::Test {
 protected:
  void add(double time_s, double x_m, double y_m, double yaw_rad = 0.0) {
    track_.add({ns(time_s), {x_m, y_m}, yaw_rad});
  }
  /// One metre a second along x, ten readings a second.
  void driveOn(double from_s, double to_s, double offset_m = 0.0) {
    for (int k = 0; from_s + 0.1 * k <= to_s + 1e-9; ++k) add(from_s + 0.1 * k, from_s + 0.1 * k + offset_m, 0.0);
  }
  std::optional<OdometryIncrement> between(double from_s, double to_s) { return track_.between(ns(from_s), ns(to_s)); }

  OdometryTrack track_{OdometryConfig()};
};

TEST_F(Odometry, AnIncrementIsInTheRobotsFrame) {
  add(0.0, 5.0, 5.0, kPi / 2.0);
  add(0.4, 5.0, 7.0, kPi);
  const auto increment = between(0.0, 0.4);
  ASSERT_TRUE(increment);
  EXPECT_NEAR((increment->translation_m - Eigen::Vector2d(2.0, 0.0)).norm(), 0.0, 1e-9);
  EXPECT_NEAR(increment->rotation_rad, kPi / 2.0, 1e-9);
  EXPECT_NEAR(increment->distance_m, 2.0, 1e-9);
}

TEST_F(Odometry, InterpolatesAndGoesOnForAMoment) {
  driveOn(0.0, 1.0);
  EXPECT_NEAR(between(0.25, 0.75)->translation_m.x(), 0.5, 1e-6);
  EXPECT_NEAR(between(0.5, 1.3)->translation_m.x(), 0.8, 1e-6);
  EXPECT_FALSE(between(0.5, 1.6)) << "half a second after the last reading";
  EXPECT_NEAR(between(0.5, 0.5)->distance_m, 0.0, 1e-12);
}

TEST_F(Odometry, TheWayIsLongerThanTheDistanceOfItsEnds) {
  for (int k = 0; k <= 40; ++k) {
    const double angle = 2.0 * kPi * k / 40.0;
    add(0.1 * k, std::cos(angle), std::sin(angle), std::remainder(angle + kPi / 2.0, 2.0 * kPi));
  }
  const auto round = between(0.0, 4.0);
  ASSERT_TRUE(round);
  EXPECT_NEAR(round->translation_m.norm(), 0.0, 1e-6);
  EXPECT_NEAR(round->distance_m, 2.0 * kPi, 0.02);
}

TEST_F(Odometry, SaysNothingAboutTimesThatItDoesNotKnow) {
  EXPECT_FALSE(between(0.0, 1.0));
  driveOn(10.0, 11.0);
  EXPECT_FALSE(between(9.0, 10.5));
  EXPECT_FALSE(between(10.8, 10.2)) << "backwards";
  EXPECT_FALSE(between(1e9, 1e9 + 1.0)) << "another clock";
}

TEST_F(Odometry, AJumpSpoilsNothingBeforeIt) {
  driveOn(0.0, 1.0);
  add(1.1, 50.0, 0.0);
  EXPECT_TRUE(between(0.0, 1.0)) << "up to the reading before it";
  EXPECT_FALSE(between(0.0, 1.05)) << "into it";
  EXPECT_FALSE(between(1.0, 1.1));
}

TEST_F(Odometry, TheFastestSpeedIsNoJump) {
  OdometryConfig config;
  config.max_speed_mps = 2.0;
  OdometryTrack track(config);
  for (const double time_s : {0.0, 0.5, 1.0}) track.add({ns(time_s), {2.0 * time_s, 0.0}, 0.0});
  EXPECT_TRUE(track.between(0, kSecond_ns));
  track.add({ns(1.5), {3.0 + 1e-6, 0.0}, 0.0});
  EXPECT_FALSE(track.between(0, ns(1.5)));
}

TEST_F(Odometry, TwentyThousandReadingsAreKept) {
  constexpr std::int64_t kStep_ns = 10'000'000;
  for (std::int64_t k = 0; k <= 20'000; ++k) track_.add({k * kStep_ns, {0.01 * static_cast<double>(k), 0.0}, 0.0});
  EXPECT_FALSE(track_.between(0, 10 * kStep_ns));
  EXPECT_TRUE(track_.between(kStep_ns, 10 * kStep_ns));
}

TEST_F(Odometry, SilenceAndJumpsAreNoMotion) {
  driveOn(0.0, 1.0);
  driveOn(2.0, 3.0);
  EXPECT_FALSE(between(0.5, 2.5)) << "silent for a second";
  driveOn(3.1, 4.0, 50.0);
  EXPECT_FALSE(between(2.5, 3.5)) << "50 m in a tenth of a second";
  EXPECT_TRUE(between(3.2, 3.9));
  add(4.1, 54.1, 0.0, 3.0);
  EXPECT_FALSE(between(3.5, 4.1)) << "3 rad in a tenth of a second";
  add(4.2, 54.2, 0.0, 3.0);
  add(4.3, 54.3, 0.0, 0.0);
  EXPECT_FALSE(between(4.15, 4.3)) << "to the right";
}

TEST_F(Odometry, LateReadingsAreIgnoredAndTimeMayGoBack) {
  driveOn(100.0, 101.0);
  add(100.55, 999.0, 999.0);
  EXPECT_NEAR(between(100.2, 100.8)->translation_m.x(), 0.6, 1e-6);
  driveOn(5.0, 6.0);  // the bag began again
  EXPECT_FALSE(between(100.2, 100.8));
  EXPECT_NEAR(between(5.2, 5.8)->translation_m.x(), 0.6, 1e-6);
}

TEST_F(Odometry, OfTwoReadingsAtOneTimeTheFirstCounts) {
  driveOn(0.0, 0.5);
  add(0.5, 0.9, 0.0);
  driveOn(0.6, 1.0);
  const auto increment = between(0.2, 0.8);
  ASSERT_TRUE(increment);
  EXPECT_NEAR(increment->translation_m.x(), 0.6, 1e-6);
  EXPECT_NEAR(increment->distance_m, 0.6, 1e-6);
}

TEST_F(Odometry, RefusesWhatIsNotFinite) {
  driveOn(0.0, 1.0);
  EXPECT_THROW(add(1.1, kNaN, 0.0), std::invalid_argument);
  EXPECT_THROW(add(1.1, 0.0, 0.0, std::numeric_limits<double>::infinity()), std::invalid_argument);
  EXPECT_TRUE(between(0.0, 1.0));
}

TEST_F(Odometry, ForgetsWhatWasLongAgo) {
  for (int k = 0; k < 30000; ++k) add(0.01 * k, 0.01 * k, 0.0);
  EXPECT_FALSE(between(50.0, 60.0));
  EXPECT_TRUE(between(110.0, 299.0));
}

}  // namespace
}  // namespace visual_localization
