#include <cmath>

#include <gtest/gtest.h>

#include "visual_localization/localization/state.h"

namespace visual_localization {
namespace {

constexpr std::int64_t kSecond = 1000000000;

TEST(MotionConsistency, AUniformMotionHasNoResidual) {
  MotionConsistency motion(10);
  for (int i = 0; i < 30; ++i) motion.add(i * kSecond, {100.0 - 3.0 * i, 0.5 * i});
  EXPECT_NEAR(motion.residual_m(), 0.0, 1e-9);
}

TEST(MotionConsistency, AUniformMotionSeenAtUnevenTimesHasNone) {
  MotionConsistency motion(10);
  for (const int seconds : {0, 1, 2, 7, 8, 20}) motion.add(seconds * kSecond, {2.0 * seconds, 0.0});
  EXPECT_NEAR(motion.residual_m(), 0.0, 1e-9);
}

TEST(MotionConsistency, WithoutUsableStampsTheOrderCounts) {
  for (const std::int64_t step : {std::int64_t{0}, -kSecond}) {
    MotionConsistency motion(10);
    for (int i = 0; i < 10; ++i) motion.add(i * step, {2.0 * i, 0.0});
    EXPECT_NEAR(motion.residual_m(), 0.0, 1e-9);
  }
}

TEST(MotionConsistency, JumpingToAndFroIsItsOwnResidual) {
  MotionConsistency motion(10);
  for (int i = 0; i < 10; ++i) motion.add(i * kSecond, {i % 2 == 0 ? 1.0 : -1.0, 2.0 * i});
  EXPECT_NEAR(motion.residual_m(), 1.0, 0.02);
}

TEST(MotionConsistency, ThreePositionsHaveAResidual) {
  for (const std::size_t length : {std::size_t{3}, std::size_t{10}}) {
    MotionConsistency motion(length);
    for (const int i : {0, 1, 2}) motion.add(i * kSecond, {i == 1 ? 1.0 : 0.0, 5.0});
    // From their mean, a third, two are a third away and one two thirds.
    EXPECT_NEAR(motion.residual_m(), std::sqrt(2.0 / 9.0), 1e-12) << length;
  }
}

TEST(MotionConsistency, RemembersOnlyItsLengthAndForgetsAltogether) {
  MotionConsistency motion(5);
  motion.add(0, {1000.0, 0.0});
  for (int i = 1; i <= 5; ++i) motion.add(i * kSecond, {2.0 * i, 0.0});
  EXPECT_NEAR(motion.residual_m(), 0.0, 1e-9);
  motion.add(6 * kSecond, {-50.0, 0.0});
  EXPECT_GT(motion.residual_m(), 5.0);
  motion.clear();
  motion.add(7 * kSecond, {0.0, 0.0});
  motion.add(8 * kSecond, {50.0, 0.0});
  EXPECT_EQ(motion.residual_m(), 0.0) << "two points are always on a line";
}

}  // namespace
}  // namespace visual_localization
