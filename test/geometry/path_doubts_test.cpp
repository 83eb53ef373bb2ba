#include "geometry/path_doubts.h"

#include <cmath>

#include <gtest/gtest.h>

#include "base/numbers.h"

namespace visual_localization {
namespace {

constexpr double kFix_m = 0.3;
constexpr double kPath_m = 0.15;

/// Images a metre and a second apart along a street, then to the left at `bend`; fixes and images agree.
std::vector<PathEvidence> drive(std::size_t images, std::size_t bend) {
  std::vector<PathEvidence> path(images);
  for (std::size_t i = 0; i < images; ++i) {
    const auto at = static_cast<double>(i);
    const auto corner = static_cast<double>(bend);
    path[i] = {static_cast<std::int64_t>(i) * 1'000'000'000,
               {std::min(at, corner), std::max(0.0, at - corner)},
               Eigen::Vector2d(0.2, -0.1),
               kFix_m,
               0.0};
  }
  return path;
}

std::vector<PathDoubt> doubts(const std::vector<PathEvidence>& path) { return doubtsOf(path, kPath_m); }

double largest_m(const std::vector<PathDoubt>& all) {
  double largest_m = 0.0;
  for (const PathDoubt& one : all) largest_m = std::max(largest_m, one.m());
  return largest_m;
}

std::vector<DoubtfulStretch> stretches(const std::vector<PathEvidence>& path) {
  const std::vector<PathDoubt> found = doubts(path);
  std::vector<double> sigmas_m;
  for (const PathDoubt& one : found) sigmas_m.push_back(one.m());
  return doubtfulStretches(path, found, sigmas_m);
}

TEST(PathDoubts, WhatFitsIsNotDoubted) {
  const std::vector<PathEvidence> path = drive(200, 100);
  EXPECT_EQ(largest_m(doubts(path)), 0.0);
  EXPECT_TRUE(stretches(path).empty());
}

TEST(PathDoubts, OfNothingThereIsNone) {
  EXPECT_TRUE(doubts({}).empty());
  EXPECT_EQ(doubts(std::vector<PathEvidence>(1)).size(), 1U);
}

TEST(PathDoubts, WithoutFixesImagesStrayFromTheLastOneThatAgrees) {
  std::vector<PathEvidence> path = drive(200, 100);
  for (std::size_t i = 50; i < 70; ++i) path[i].off_fixes_m.reset();
  const std::vector<PathDoubt> found = doubts(path);
  EXPECT_NEAR(found[54].m(), 5.0 * kDrift, 1e-9);
  EXPECT_NEAR(found[68].m(), 2.0 * kDrift, 1e-9);
  EXPECT_TRUE(stretches(path).empty()) << "nothing contradicts";
  for (PathEvidence& at : path) at.off_fixes_m.reset();
  EXPECT_NEAR(doubts(path)[0].m(), 199.0 * kDrift, 1e-9) << "at most the whole way";
}

/// As of a receiver that starts cold: fixes that are metres off, at the end of a path where nothing else holds it.
TEST(PathDoubts, FixesThatAreOffDoNotConfirmThePath) {
  std::vector<PathEvidence> path = drive(200, 100);
  for (std::size_t i = 0; i < 40; ++i) path[i].off_fixes_m = Eigen::Vector2d(0.0, 6.0);
  const std::vector<PathDoubt> found = doubts(path);
  const double off_m = std::sqrt(0.5 * 36.0 - kFix_m * kFix_m);
  EXPECT_NEAR(found[10].m(), off_m, 1e-9) << "nobody knows which of them is right";
  EXPECT_TRUE(found[10].fails);
  EXPECT_NEAR(found[59].m(), off_m / 2.0 + 20.0 * kDrift, 0.1) << "they pull the path beside them as well";
  EXPECT_FALSE(found[59].fails);
  EXPECT_EQ(found[80].m(), 0.0);
  const std::vector<DoubtfulStretch> said = stretches(path);
  ASSERT_EQ(said.size(), 1U);
  EXPECT_EQ(said[0].from_ns, 0);
  EXPECT_EQ(said[0].to_ns, 39'000'000'000);
  EXPECT_EQ(said[0].to_m, 39.0);
  EXPECT_EQ(said[0].off_fixes_m, 6.0);
}

TEST(PathDoubts, AcrossABreakOfTheImagesNothingIsConfirmed) {
  std::vector<PathEvidence> path = drive(200, 100);
  for (std::size_t i = 50; i < 70; ++i) path[i].off_fixes_m.reset();
  path[52].turned_rad.reset();
  const std::vector<PathDoubt> found = doubts(path);
  EXPECT_NEAR(found[51].m(), 2.0 * kDrift, 1e-9);
  EXPECT_NEAR(found[52].m(), 18.0 * kDrift, 1e-9);
}

/// As after a step of the camera's clock: the path turns where the fixes turned, the images do so 40 m before.
TEST(PathDoubts, APathThatTurnsElsewhereThanTheImagesIsWrong) {
  std::vector<PathEvidence> path = drive(200, 100);
  path[60].turned_rad = 0.5 * kPi;
  path[100].turned_rad = -0.5 * kPi;
  const std::vector<PathDoubt> found = doubts(path);
  EXPECT_GT(found[80].m(), 8.0);
  EXPECT_LT(found[80].m(), 40.0);
  ASSERT_EQ(stretches(path).size(), 1U);
  EXPECT_GT(stretches(path)[0].off_turns_m, 8.0);
}

/// A clock that has stepped does not come right on a straight street.
TEST(PathDoubts, AStraightStreetConfirmsNothing) {
  std::vector<PathEvidence> path = drive(600, 100);
  path[60].turned_rad = 0.5 * kPi;
  path[100].turned_rad = -0.5 * kPi;
  EXPECT_GT(doubts(path)[599].m(), 8.0);
}

TEST(PathDoubts, WhatImagesDoNotTieIsJudgedByItself) {
  std::vector<PathEvidence> path = drive(200, 100);
  path[60].turned_rad = 0.5 * kPi;
  path[100].turned_rad = -0.5 * kPi;
  path[50].turned_rad.reset();
  const std::vector<PathDoubt> found = doubts(path);
  EXPECT_EQ(found[49].m(), 0.0);
  EXPECT_GT(found[51].m(), 8.0);
}

TEST(PathDoubts, ImagesThatStrayALittleAreNoContradiction) {
  std::vector<PathEvidence> path = drive(200, 100);
  for (std::size_t i = 0; i < path.size(); ++i) path[i].turned_rad = toRadians(i % 2 == 0 ? 0.6 : -0.5);
  EXPECT_EQ(largest_m(doubts(path)), 0.0);
}

}  // namespace
}  // namespace visual_localization
