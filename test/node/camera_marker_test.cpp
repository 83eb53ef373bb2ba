#include <cmath>

#include <gtest/gtest.h>

#include "node/markers.h"
#include "test/node/map_header.h"
#include "test/support/example_map.h"

namespace visual_localization {
namespace {

using visualization_msgs::Marker;

std_msgs::Header cameraHeader() { return test::mapHeader({12, 5}); }

/// Level, 2 m up, looking north.
Estimate levelEstimate() {
  Estimate estimate;
  estimate.metric = MetricPose();
  estimate.metric->camera.position_m = {10.0, 20.0, 2.0};
  estimate.metric->camera.rotation = levelCamera(0.5 * M_PI);
  return estimate;
}

/// 180 degrees from corner to corner and beyond: the lens shows nothing in the corners.
CameraModel fisheye() {
  return CameraModel({{640, 480}, 200.0, 200.0, 319.5, 239.5, Distortion::kEquidistant, {0.0, 0.0, 0.0, 0.0}});
}

std::size_t finitePoints(const Marker& marker) {
  std::size_t finite = 0;
  for (const auto& point : marker.points) {
    finite += std::isfinite(point.x) && std::isfinite(point.y) && std::isfinite(point.z) ? 1U : 0U;
  }
  return finite;
}

TEST(CameraMarker, IsAFrustumAtTheCameraThatOpensWhereItLooks) {
  const Marker marker = toCameraMarker(levelEstimate(), test::exampleCamera(), cameraHeader());
  EXPECT_EQ(marker.action, Marker::ADD);
  EXPECT_EQ(marker.type, Marker::LINE_LIST);
  EXPECT_EQ(marker.header.frame_id, "map");
  EXPECT_EQ(marker.header.stamp, cameraHeader().stamp);
  ASSERT_EQ(marker.points.size(), 20U) << "four rays, four edges and a roof of two";
  EXPECT_EQ(finitePoints(marker), marker.points.size());
  const auto& upper_left = marker.points[1];
  const auto& lower_right = marker.points[9];
  EXPECT_LT(upper_left.x, 10.0) << "left is west";
  EXPECT_GT(upper_left.y, 22.0);
  EXPECT_GT(upper_left.z, 2.0);
  EXPECT_GT(lower_right.x, 10.0);
  EXPECT_LT(lower_right.z, 2.0);
  EXPECT_GT(marker.points[17].z, upper_left.z) << "the roof is above";
}

TEST(CameraMarker, HasTheFieldOfViewOfTheCalibration) {
  const Marker marker =
      toCameraMarker(levelEstimate(), CameraModel({{640, 480}, 320.0, 320.0, 319.5, 239.5, Distortion::kPlumbBob, {}}),
                     cameraHeader());
  const auto& upper_left = marker.points[1];
  EXPECT_NEAR((10.0 - upper_left.x) / (upper_left.y - 20.0), 1.0, 1e-6) << "90 degrees wide";
  EXPECT_NEAR((upper_left.z - 2.0) / (upper_left.y - 20.0), 0.75, 1e-6);
}

TEST(CameraMarker, IsFiniteForALensThatShowsNothingInTheCorners) {
  const Marker marker = toCameraMarker(levelEstimate(), fisheye(), cameraHeader());
  EXPECT_EQ(marker.action, Marker::ADD);
  ASSERT_EQ(marker.points.size(), 20U);
  EXPECT_EQ(finitePoints(marker), marker.points.size());
}

TEST(CameraMarker, IsTakenAwayWithoutAMetricPoseOrACamera) {
  EXPECT_EQ(toCameraMarker(Estimate(), test::exampleCamera(), cameraHeader()).action, Marker::DELETE);
  EXPECT_EQ(toCameraMarker(levelEstimate(), std::nullopt, cameraHeader()).action, Marker::DELETE);
  const Marker shown = toCameraMarker(levelEstimate(), test::exampleCamera(), cameraHeader());
  const Marker taken_away = toCameraMarker(Estimate(), test::exampleCamera(), cameraHeader());
  EXPECT_EQ(taken_away.ns, shown.ns);
  EXPECT_EQ(taken_away.id, shown.id);
  EXPECT_TRUE(taken_away.points.empty());
}

TEST(CameraMarker, HasNothingThatIsNotFinite) {
  Estimate estimate = levelEstimate();
  estimate.metric->camera.position_m.x() = std::nan("");
  EXPECT_EQ(toCameraMarker(estimate, test::exampleCamera(), cameraHeader()).action, Marker::DELETE);
}

}  // namespace
}  // namespace visual_localization
