#include <cmath>

#include <gtest/gtest.h>

#include "visual_localization/localization/state.h"

namespace visual_localization {
namespace {

constexpr std::int64_t kSecond = 1000000000;

TEST(Course, AUniformMotionHasNoResidual) {
  Course course(10);
  for (int i = 0; i < 30; ++i) course.add(i * kSecond, {100.0 - 3.0 * i, 0.5 * i});
  EXPECT_NEAR(course.residual_m(), 0.0, 1e-9);
}

TEST(Course, AUniformMotionSeenAtUnevenTimesHasNone) {
  Course course(10);
  for (const int seconds : {0, 1, 2, 7, 8, 20}) course.add(seconds * kSecond, {2.0 * seconds, 0.0});
  EXPECT_NEAR(course.residual_m(), 0.0, 1e-9);
}

TEST(Course, WithoutUsableStampsTheOrderCounts) {
  for (const std::int64_t step : {std::int64_t{0}, -kSecond}) {
    Course course(10);
    for (int i = 0; i < 10; ++i) course.add(i * step, {2.0 * i, 0.0});
    EXPECT_NEAR(course.residual_m(), 0.0, 1e-9);
  }
}

TEST(Course, JumpingToAndFroIsItsOwnResidual) {
  Course course(10);
  for (int i = 0; i < 10; ++i) course.add(i * kSecond, {i % 2 == 0 ? 1.0 : -1.0, 2.0 * i});
  EXPECT_NEAR(course.residual_m(), 1.0, 0.02);
}

TEST(Course, RemembersOnlyItsLengthAndForgetsAltogether) {
  Course course(5);
  course.add(0, {1000.0, 0.0});
  for (int i = 1; i <= 5; ++i) course.add(i * kSecond, {2.0 * i, 0.0});
  EXPECT_NEAR(course.residual_m(), 0.0, 1e-9);
  course.add(6 * kSecond, {-50.0, 0.0});
  EXPECT_GT(course.residual_m(), 5.0);
  course.clear();
  course.add(7 * kSecond, {0.0, 0.0});
  course.add(8 * kSecond, {50.0, 0.0});
  EXPECT_EQ(course.residual_m(), 0.0) << "two points are always on a line";
}

}  // namespace
}  // namespace visual_localization
