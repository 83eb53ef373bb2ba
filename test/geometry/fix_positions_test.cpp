#include <gtest/gtest.h>

#include "geometry/reconstruction.h"
#include "test/support/stamps.h"

namespace visual_localization {
namespace {

using test::kSecond_ns;

/// An image a second, two metres apart on the way east.
std::vector<TrajectoryPoint> pathOf(std::size_t count) {
  std::vector<TrajectoryPoint> images;
  for (std::size_t i = 0; i < count; ++i) {
    images.push_back({static_cast<std::int64_t>(i) * kSecond_ns, {2.0 * static_cast<double>(i), 0.0}, 0.0});
  }
  return images;
}

MapFix fixAt(double time_s, const Eigen::Vector2d& position_m) {
  return {static_cast<std::int64_t>(time_s * kSecond_ns), position_m};
}

TEST(FixPositions, MoveFixesAlongThePathToTheImage) {
  // Every fix is 0.5 m north of the path, before, at and behind the image of second 1.
  const auto positions =
      positionsAt(pathOf(3), {fixAt(0.8, {1.6, 0.5}), fixAt(1.0, {2.0, 0.5}), fixAt(1.3, {2.6, 0.5})}, 1.0);
  ASSERT_EQ(positions.size(), 1U);
  EXPECT_EQ(positions[0].image, 1U);
  EXPECT_LT((positions[0].east_north_m - Eigen::Vector2d(2.0, 0.5)).norm(), 1e-9);
}

TEST(FixPositions, TakeTheMedian) {
  const auto positions =
      positionsAt(pathOf(3), {fixAt(0.9, {1.8, 0.1}), fixAt(1.0, {2.0, 50.0}), fixAt(1.1, {2.2, 0.3})}, 1.0);
  ASSERT_EQ(positions.size(), 1U);
  EXPECT_LT((positions[0].east_north_m - Eigen::Vector2d(2.0, 0.3)).norm(), 1e-9);
}

TEST(FixPositions, GiveEachFixToTheNearestImage) {
  const auto positions =
      positionsAt(pathOf(3), {fixAt(0.4, {0.8, 1.0}), fixAt(0.6, {1.2, 2.0}), fixAt(1.9, {3.8, 3.0})}, 1.0);
  ASSERT_EQ(positions.size(), 3U);
  for (std::uint32_t i = 0; i < 3; ++i) {
    EXPECT_EQ(positions[i].image, i);
    EXPECT_LT((positions[i].east_north_m - Eigen::Vector2d(2.0 * i, 1.0 + i)).norm(), 1e-9) << i;
  }
}

TEST(FixPositions, AreNoneWithoutFixesNearby) {
  EXPECT_TRUE(positionsAt(pathOf(3), {}, 1.0).empty());
  EXPECT_TRUE(positionsAt({}, {fixAt(0.0, {0.0, 0.0})}, 1.0).empty());
  std::vector<TrajectoryPoint> rare{{0, {0.0, 0.0}, 0.0}, {10 * kSecond_ns, {20.0, 0.0}, 0.0}};
  EXPECT_TRUE(positionsAt(rare, {fixAt(3.0, {6.0, 0.0})}, 1.0).empty()) << "half a second at most";
}

}  // namespace
}  // namespace visual_localization
