#include "geo/clock_offset.h"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "test/geo/recorded_round.h"

namespace visual_localization {
namespace {

using test::block;
using test::Path;

constexpr double kDuration_s = 400.0;
constexpr double kWidth_rad = 1.1;  // of a usual lens

double yawOf(const Path& path, double time_s) {
  const Eigen::Vector2d travel = path(time_s + 0.05) - path(time_s - 0.05);
  return std::atan2(travel.y(), travel.x());
}

/// What a camera sees that looks where the robot drives: an image a second. `angle_rad`: the camera's roll.
std::vector<PictureShift> picturesOf(const Path& path, double roll_rad = 0.0) {
  std::mt19937 engine(3);
  std::normal_distribution<double> noise(0.0, 0.003);
  std::vector<PictureShift> pictures;
  for (double time_s = 1.0; time_s < kDuration_s; time_s += 1.0) {
    const double turn_rad = angleDifference(yawOf(path, time_s - 1.0), yawOf(path, time_s));
    const double shift = turn_rad / kWidth_rad + noise(engine);
    pictures.push_back({test::stampOf(time_s - 1.0),
                        test::stampOf(time_s),
                        {std::cos(roll_rad) * shift + noise(engine), std::sin(roll_rad) * shift}});
  }
  return pictures;
}

/// Fixes five times a second, stamped too late by `late_s`.
std::vector<StampedPosition> coursePathOf(const Path& path, double late_s, double noise_m) {
  std::mt19937 engine(5);
  std::normal_distribution<double> noise(0.0, noise_m);
  std::vector<StampedPosition> fixes;
  for (double time_s = 0.07; time_s < kDuration_s; time_s += 0.2) {
    const double x = noise(engine);
    fixes.push_back({test::stampOf(time_s + late_s), path(time_s) + Eigen::Vector2d(x, noise(engine))});
  }
  return fixes;
}

class ClockOffsetTest : public testing::TestWithParam<double> {};

TEST_P(ClockOffsetTest, IsFoundByTheTurns) {
  const auto exact = clockOffset(picturesOf(block), coursePathOf(block, GetParam(), 0.02));
  ASSERT_TRUE(exact);
  EXPECT_NEAR(exact->offset_s, GetParam(), 0.1);
  EXPECT_NEAR(exact->width_rad, kWidth_rad, 0.1);
  EXPECT_TRUE(exact->along_rows);
  const auto noisy = clockOffset(picturesOf(block), coursePathOf(block, GetParam(), 0.12));
  ASSERT_TRUE(noisy);
  EXPECT_NEAR(noisy->offset_s, GetParam(), 3.0 * noisy->sigma_s);
  EXPECT_LT(noisy->sigma_s, 0.3);
}

INSTANTIATE_TEST_SUITE_P(Offsets, ClockOffsetTest, testing::Values(0.0, 0.5, 2.0, 5.0, 18.0, -18.0, 29.0));

TEST(ClockOffset, SaysHowMuchWorseNoOffsetIs) {
  EXPECT_LT(clockOffset(picturesOf(block), coursePathOf(block, 0.0, 0.05))->at_zero_sigmas, 2.0);
  EXPECT_GT(clockOffset(picturesOf(block), coursePathOf(block, 5.0, 0.05))->at_zero_sigmas, 5.0);
}

TEST(ClockOffset, IsNothingWithoutTurns) {
  const Path straight = [](double time_s) { return Eigen::Vector2d(test::kSpeed * time_s, 0.0); };
  EXPECT_FALSE(clockOffset(picturesOf(straight), coursePathOf(straight, 0.0, 0.12)));
  EXPECT_FALSE(clockOffset(picturesOf(block), coursePathOf(straight, 0.0, 0.12)));
  EXPECT_FALSE(clockOffset(picturesOf(straight), coursePathOf(block, 0.0, 0.12)));
}

TEST(ClockOffset, IsNothingForPicturesOfAnotherDrive) {
  const Path other = [](double time_s) {  // bends to either side that the block does not have
    const double along_m = test::kSpeed * time_s;
    return Eigen::Vector2d(along_m, 8.0 * std::sin(along_m / 11.0) + 5.0 * std::cos(along_m / 17.0));
  };
  EXPECT_FALSE(clockOffset(picturesOf(block), coursePathOf(other, 0.0, 0.12)));
  EXPECT_FALSE(clockOffset(picturesOf(other), coursePathOf(block, 0.0, 0.12)));
}

TEST(ClockOffset, IsNothingByASingleTurn) {
  const auto aside = [](double by_m, double from_s, double lasts_s) {
    return Path([=](double time_s) {
      const double share = std::clamp((time_s - from_s) / lasts_s, 0.0, 1.0);
      return Eigen::Vector2d(test::kSpeed * time_s, by_m * share * share * (3.0 - 2.0 * share));
    });
  };
  for (const double step_m : {0.2, 0.4, 1.0, 4.0}) {
    for (const double swerve_s : {1.0, 2.0, 4.0}) {
      const auto fixes = coursePathOf(aside(step_m, 180.0, 0.01), 0.0, 0.02);
      EXPECT_FALSE(clockOffset(picturesOf(aside(0.6, 200.0, swerve_s)), fixes)) << step_m << " m, " << swerve_s << " s";
    }
  }
}

TEST(ClockOffset, IsNothingBeyondItsReach) {
  EXPECT_FALSE(clockOffset(picturesOf(block), coursePathOf(block, 45.0, 0.05)));
  EXPECT_FALSE(clockOffset(picturesOf(block), coursePathOf(block, 3600.0, 0.05)));
}

TEST(ClockOffset, SeesPicturesThatTurnTheWrongWay) {
  auto mirrored = picturesOf(block);
  for (PictureShift& picture : mirrored) picture.shift.x() *= -1.0;
  const auto found = clockOffset(mirrored, coursePathOf(block, 0.0, 0.05));
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->width_rad, -kWidth_rad, 0.1);
}

TEST(ClockOffset, FindsTurnsInPortraitImages) {
  const auto found = clockOffset(picturesOf(block, kPi / 2.0), coursePathOf(block, 2.0, 0.02));
  ASSERT_TRUE(found);
  EXPECT_FALSE(found->along_rows);
  EXPECT_NEAR(found->offset_s, 2.0, 0.1);
}

TEST(ClockOffset, IsNothingForFewImages) {
  EXPECT_FALSE(clockOffset({}, coursePathOf(block, 0.0, 0.05)));
  EXPECT_FALSE(clockOffset(picturesOf(block), {}));
}

}  // namespace
}  // namespace visual_localization
