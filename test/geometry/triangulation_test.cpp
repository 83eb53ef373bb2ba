#include <cmath>

#include <gtest/gtest.h>

#include "geometry/feature_tracks.h"

namespace visual_localization {
namespace {

constexpr double kMinAngle_rad = 0.01;

/// Level cameras that look north, at these places on the east axis.
std::vector<CameraPose> camerasAt(const std::vector<double>& east_m) {
  std::vector<CameraPose> cameras;
  for (const double east : east_m) cameras.push_back({levelCamera(std::acos(0.0)), {east, 0.0, 0.0}});
  return cameras;
}

std::vector<Sight> sightsOf(const std::vector<CameraPose>& cameras, const Eigen::Vector3d& point_m) {
  std::vector<Sight> sights;
  for (const CameraPose& camera : cameras) sights.push_back({&camera, camera.toCamera(point_m).hnormalized()});
  return sights;
}

TEST(Triangulation, IsExactWithoutNoise) {
  const Eigen::Vector3d point_m(2.0, 10.0, 3.0);
  const auto cameras = camerasAt({0.0, 0.5, 1.0});
  const auto found = triangulate(sightsOf(cameras, point_m), kMinAngle_rad);
  ASSERT_TRUE(found);
  EXPECT_NEAR((*found - point_m).norm(), 0.0, 1e-9);
}

TEST(Triangulation, IsExactFarFromTheOrigin) {
  const Eigen::Vector3d origin_m(8e4, -5e4, 300.0);
  auto cameras = camerasAt({0.0, 0.5});
  for (CameraPose& camera : cameras) camera.position_m += origin_m;
  const Eigen::Vector3d point_m = origin_m + Eigen::Vector3d(2.0, 10.0, 3.0);
  const auto found = triangulate(sightsOf(cameras, point_m), kMinAngle_rad);
  ASSERT_TRUE(found);
  EXPECT_NEAR((*found - point_m).norm(), 0.0, 1e-6);
}

TEST(Triangulation, OfParallelRaysIsNothing) {
  const auto cameras = camerasAt({0.0, 1.0});
  const Eigen::Vector2d ahead(0.1, 0.0);
  EXPECT_FALSE(triangulate({{&cameras[0], ahead}, {&cameras[1], ahead}}, kMinAngle_rad));
  EXPECT_FALSE(triangulate({{&cameras[0], ahead}, {&cameras[1], ahead}}, 0.0)) << "even if any angle would do";
}

TEST(Triangulation, AsksForTheAngle) {
  const auto cameras = camerasAt({0.0, 1.0});
  EXPECT_TRUE(triangulate(sightsOf(cameras, {0.5, 1.0 / 0.012, 0.0}), kMinAngle_rad));
  EXPECT_FALSE(triangulate(sightsOf(cameras, {0.5, 1.0 / 0.008, 0.0}), kMinAngle_rad));
}

TEST(Triangulation, TakesTheWidestAngleWhateverTheOrder) {
  const Eigen::Vector3d point_m(0.5, 1.0 / 0.012, 0.0);
  for (const std::vector<double>& east_m : {std::vector<double>{0.0, 0.5, 1.0}, {0.5, 0.0, 1.0}, {1.0, 0.0, 0.5}}) {
    const auto cameras = camerasAt(east_m);
    EXPECT_TRUE(triangulate(sightsOf(cameras, point_m), kMinAngle_rad)) << east_m.front();
  }
}

TEST(Triangulation, OfRaysThatMeetBehindTheCamerasIsNothing) {
  const auto cameras = camerasAt({0.0, 1.0});
  EXPECT_FALSE(triangulate(sightsOf(cameras, {0.5, -10.0, 1.0}), kMinAngle_rad));
}

TEST(Triangulation, OfRaysThatMeetBehindOneCameraIsNothing) {
  auto cameras = camerasAt({0.0, 1.0});
  cameras[1].position_m.y() = 20.0;
  EXPECT_FALSE(triangulate(sightsOf(cameras, {5.0, 10.0, 1.0}), kMinAngle_rad));
}

TEST(Triangulation, NeedsTwoRays) {
  const auto cameras = camerasAt({0.0});
  EXPECT_FALSE(triangulate({}, 0.0));
  EXPECT_FALSE(triangulate(sightsOf(cameras, {0.0, 10.0, 0.0}), 0.0));
}

}  // namespace
}  // namespace visual_localization
