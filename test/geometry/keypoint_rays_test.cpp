#include <cmath>

#include <gtest/gtest.h>

#include "geometry/rays.h"
#include "test/support/landmark_world.h"
#include "visual_localization/features/sift.h"

namespace visual_localization {
namespace {

LocalFeatures featuresAt(const Keypoints& keypoints) {
  return LocalFeatures(keypoints, std::vector<std::uint8_t>(keypoints.size() * kSiftDimension, 1));
}

TEST(KeypointRays, LookToWhereTheCameraProjectsFrom) {
  const CameraModel camera = test::streetCamera();
  const Eigen::Vector3d point(1.5, -1.0, 4.0);
  const Eigen::Vector2f pixel = camera.project(point).cast<float>();
  const KeypointRays rays = raysOf(featuresAt({{pixel.x(), pixel.y(), 4.0F, 0.0F}}), camera);
  ASSERT_EQ(rays.normalised.size(), 1U);
  EXPECT_LT((rays.normalised[0] - point.hnormalized()).norm(), 1e-6);  // a float is a ten-thousandth of a pixel
}

TEST(KeypointRays, OfLargeFeaturesAreLessExact) {
  const LocalFeatures features = featuresAt({{300.0F, 200.0F, 0.0F, 0.0F}, {300.0F, 200.0F, 60.0F, 0.0F}});
  const KeypointRays rays = raysOf(features, test::streetCamera());
  EXPECT_NEAR(rays.sigmas[0], 0.3 / 450.0, 1e-9);
  EXPECT_NEAR(rays.sigmas[1] / rays.sigmas[0], std::hypot(1.0, 10.0), 1e-6);
}

TEST(KeypointRays, OfNothingAreNone) {
  const KeypointRays rays = raysOf(LocalFeatures(), test::streetCamera());
  EXPECT_TRUE(rays.normalised.empty());
  EXPECT_TRUE(rays.sigmas.empty());
}

TEST(KeypointRays, AreUsableWhereBothImagesHaveThem) {
  const Eigen::Vector2d none(std::nan(""), std::nan(""));
  KeypointRays a;
  a.normalised = {{0.0, 0.0}, none, {0.1, 0.0}};
  KeypointRays b;
  b.normalised = {none, {0.0, 0.0}};
  const auto kept = usable({{0, 0}, {0, 1}, {1, 1}, {2, 1}}, a, b);
  ASSERT_EQ(kept.size(), 2U);
  EXPECT_EQ(kept[0].a, 0U);
  EXPECT_EQ(kept[1].a, 2U);
}

}  // namespace
}  // namespace visual_localization
