#include <cmath>

#include <gtest/gtest.h>

#include "base/numbers.h"
#include "geometry/feature_tracks.h"

namespace visual_localization {
namespace {

using Pairs = std::vector<std::pair<std::uint32_t, std::uint32_t>>;

/// A straight drive to the east, an image every metre.
std::vector<PathImage> straightPath(std::uint32_t session, std::size_t images, double north_m, double yaw_rad = 0.0) {
  std::vector<PathImage> path;
  for (std::size_t i = 0; i < images; ++i) {
    const double way_m = static_cast<double>(i);
    const Eigen::Vector2d position_m(std::abs(yaw_rad) < 1.0 ? way_m : 100.0 - way_m, north_m);
    path.push_back({session, {static_cast<std::int64_t>(i) * 1'000'000'000, position_m, yaw_rad}});
  }
  return path;
}

std::vector<PathImage> joined(std::vector<PathImage> a, const std::vector<PathImage>& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

TEST(Revisits, AreNoneOnAStraightDrive) { EXPECT_TRUE(revisits(straightPath(0, 200, 0.0)).empty()); }

TEST(Revisits, AreTheNearestImagesOfTheOtherSession) {
  const Pairs pairs = revisits(joined(straightPath(0, 100, 0.0), straightPath(1, 100, 2.0)));
  ASSERT_EQ(pairs.size(), 100U);
  for (const auto& [a, b] : pairs) EXPECT_EQ(a + 100, b);
}

TEST(Revisits, NeedSessionsThatAreNear) {
  EXPECT_TRUE(revisits(joined(straightPath(0, 100, 0.0), straightPath(1, 100, 8.5))).empty());
}

TEST(Revisits, NeedImagesThatFaceAlike) {
  EXPECT_TRUE(revisits(joined(straightPath(0, 100, 0.0), straightPath(1, 100, 0.0, kPi))).empty());
}

TEST(Revisits, CloseARound) {
  std::vector<PathImage> round;
  for (int i = 0; i <= 100; ++i) {
    const double angle_rad = 2.0 * kPi * i / 100.0;
    const Eigen::Vector2d position_m(50.0 * std::sin(angle_rad), -50.0 * std::cos(angle_rad));
    round.push_back({0, {i * std::int64_t{1'000'000'000}, position_m, angle_rad}});
  }
  const Pairs pairs = revisits(round);
  ASSERT_FALSE(pairs.empty());
  for (const auto& [a, b] : pairs) {
    EXPECT_LE(a, 2U);
    EXPECT_GE(b, 98U);
  }
}

TEST(Revisits, AreThreeForAnImageAtMost) {
  std::vector<PathImage> path;
  for (std::uint32_t session = 0; session < 6; ++session) path = joined(path, straightPath(session, 3, 0.5 * session));
  EXPECT_EQ(revisits(path).size(), 3U * (0 + 1 + 2 + 3 + 3 + 3));
}

TEST(Revisits, OfNothingAreNone) { EXPECT_TRUE(revisits({}).empty()); }

}  // namespace
}  // namespace visual_localization
