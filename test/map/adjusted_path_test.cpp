// Where the robot was at images without landmarks, between those that have some.

#include <optional>
#include <vector>

#include <gtest/gtest.h>

#include "base/numbers.h"
#include "map/map_geometry.h"
#include "test/support/stamps.h"

namespace visual_localization {
namespace {

using test::kSecond_ns;

/// East along x with an image every 4 m; the receiver has all of it `aside_m` too far north.
std::vector<TrajectoryPoint> eastwards(std::size_t images, double aside_m) {
  std::vector<TrajectoryPoint> path;
  for (std::size_t i = 0; i < images; ++i) {
    const double share = static_cast<double>(i);
    path.push_back({static_cast<std::int64_t>(i) * kSecond_ns, {4.0 * share, aside_m}, 0.0});
  }
  return path;
}

/// Of a camera where the robot is, that looks where it drives.
ImageGeometry seenFrom(const Eigen::Vector2d& position_m, double yaw_rad) {
  ImageGeometry geometry;
  geometry.camera = {levelCamera(yaw_rad), {position_m.x(), position_m.y(), 0.0}};
  return geometry;
}

std::vector<TrajectoryPoint> adjusted(const std::vector<TrajectoryPoint>& path,
                                      const std::vector<std::optional<ImageGeometry>>& images) {
  return adjustedPath(path, SensorMount(), images);
}

TEST(AdjustedPath, IsWhereTheCamerasAre) {
  const auto path = adjusted(eastwards(2, 6.0), {seenFrom({0.5, 0.0}, 0.1), seenFrom({4.5, 0.2}, 0.2)});
  EXPECT_TRUE(path[0].position_m.isApprox(Eigen::Vector2d(0.5, 0.0)));
  EXPECT_NEAR(path[0].yaw_rad, 0.1, 1e-9);
  EXPECT_TRUE(path[1].position_m.isApprox(Eigen::Vector2d(4.5, 0.2)));
  EXPECT_NEAR(path[1].yaw_rad, 0.2, 1e-9);
}

// The cameras have moved by -6 and -2 m and turned by 0.3 and -0.1; half a second after the first is a quarter of it.
TEST(AdjustedPath, WhatShowsNothingMovesWithItsNeighboursInProportionToTheTime) {
  std::vector<TrajectoryPoint> before = eastwards(4, 6.0);
  before[1].stamp_ns = kSecond_ns / 2;
  before[2].stamp_ns = kSecond_ns;
  before[3].stamp_ns = 2 * kSecond_ns;
  const auto path = adjusted(before, {seenFrom({0.0, 0.0}, 0.3), {}, {}, seenFrom({12.0, 4.0}, -0.1)});
  EXPECT_TRUE(path[1].position_m.isApprox(Eigen::Vector2d(4.0, 1.0))) << path[1].position_m.transpose();
  EXPECT_NEAR(path[1].yaw_rad, 0.2, 1e-9);
  EXPECT_TRUE(path[2].position_m.isApprox(Eigen::Vector2d(8.0, 2.0))) << path[2].position_m.transpose();
  EXPECT_NEAR(path[2].yaw_rad, 0.1, 1e-9);
}

TEST(AdjustedPath, TurnsTheShorterWay) {
  std::vector<TrajectoryPoint> before = eastwards(3, 0.0);
  for (TrajectoryPoint& point : before) point.yaw_rad = 3.0;
  const auto path = adjusted(before, {seenFrom({0.0, 0.0}, 3.1), {}, seenFrom({8.0, 0.0}, -3.1)});
  EXPECT_NEAR(path[1].yaw_rad, kPi, 1e-9);
}

TEST(AdjustedPath, StaysByItsFixesAtTheEndsAndFarFromLandmarks) {
  const std::vector<TrajectoryPoint> before = eastwards(14, 6.0);
  std::vector<std::optional<ImageGeometry>> images(before.size());
  images[1] = seenFrom({4.0, 0.0}, 0.0);
  images[3] = seenFrom({12.0, 0.0}, 0.0);
  images[11] = seenFrom({44.0, 0.0}, 0.0);  // 32 m on
  const auto path = adjusted(before, images);
  EXPECT_NEAR(path[2].position_m.y(), 0.0, 1e-9) << "8 m between landmarks";
  for (const std::size_t i : {0U, 4U, 7U, 10U, 12U, 13U}) {
    EXPECT_EQ(path[i].position_m, before[i].position_m) << i;
    EXPECT_EQ(path[i].yaw_rad, before[i].yaw_rad) << i;
  }
}

}  // namespace
}  // namespace visual_localization
