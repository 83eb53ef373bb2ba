#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "node/markers.h"
#include "test/node/small_map.h"

namespace visual_localization {
namespace {

using visualization_msgs::Marker;

/// An image at (east, 0, 2) m with `count` landmarks above each other, whose numbers begin at `first`.
TrainingImage imageWithLandmarks(double east_m, std::uint32_t first, std::uint32_t count) {
  TrainingImage image;
  image.position_m = {east_m, 0.0};
  image.local = test::randomFeatures(first, count);
  ImageGeometry geometry;
  geometry.camera.position_m = {east_m, 0.0, 2.0};
  for (std::uint32_t i = 0; i < count; ++i) {
    SeenLandmark landmark;
    landmark.feature = i;
    landmark.id = first + i;
    landmark.offset_m = {0.0F, 10.0F, static_cast<float>(i)};
    geometry.landmarks.push_back(landmark);
  }
  image.geometry = geometry;
  return image;
}

TrainingMap mapOf(std::vector<TrainingImage> images) {
  MapHeader header = test::smallMap()->header();
  header.sessions = {{"one"}};
  return TrainingMap(header, std::move(images));
}

/// One or none.
std::vector<Marker> landmarksOf(const TrainingMap& map) {
  std::vector<Marker> found;
  for (const Marker& marker : toMarkers(map, "map").markers) {
    if (marker.ns == "landmarks") found.push_back(marker);
  }
  return found;
}

TEST(MapMessages, EachLandmarkIsOnePointHoweverManyImagesShowIt) {
  const auto found = landmarksOf(mapOf({imageWithLandmarks(0.0, 5, 4), imageWithLandmarks(1.0, 7, 4)}));
  ASSERT_EQ(found.size(), 1U);
  const Marker& marker = found.front();
  EXPECT_EQ(marker.type, Marker::POINTS);
  EXPECT_EQ(marker.header.frame_id, "map");
  ASSERT_EQ(marker.points.size(), 6U) << "5, 6, 7, 8 of the first image, 9 and 10 of the second";
  EXPECT_EQ(marker.points[3].x, 0.0);
  EXPECT_EQ(marker.points[3].y, 10.0);
  EXPECT_EQ(marker.points[3].z, 5.0);
  EXPECT_EQ(marker.points[4].x, 1.0);
  EXPECT_EQ(marker.points[4].z, 4.0);
}

TEST(MapMessages, LandmarksAreColouredByHeight) {
  const auto found = landmarksOf(mapOf({imageWithLandmarks(0.0, 0, 100)}));
  ASSERT_EQ(found.size(), 1U);
  const auto& colours = found.front().colors;
  ASSERT_EQ(colours.size(), 100U);
  for (std::size_t i = 0; i < colours.size(); ++i) {
    for (const float part : {colours[i].r, colours[i].g, colours[i].b}) EXPECT_TRUE(part >= 0.0F && part <= 1.0F);
    EXPECT_EQ(colours[i].a, 1.0F);
    if (i > 0) {
      EXPECT_GE(colours[i].g, colours[i - 1].g);
    }
  }
  EXPECT_GT(colours[60].g, colours[40].g);
}

TEST(MapMessages, LandmarksOfOneHeightHaveAColourToo) {
  const auto found = landmarksOf(mapOf({imageWithLandmarks(0.0, 0, 1)}));
  ASSERT_EQ(found.size(), 1U);
  ASSERT_EQ(found.front().colors.size(), 1U);
  EXPECT_TRUE(std::isfinite(found.front().colors[0].r));
}

TEST(MapMessages, AMapWithoutLandmarksHasNoMarkerOfThem) {
  EXPECT_TRUE(landmarksOf(*test::smallMap()).empty());
  EXPECT_TRUE(landmarksOf(mapOf({imageWithLandmarks(0.0, 0, 0)})).empty());
}

TEST(MapMessages, OfACityAtMost200000LandmarksAreShown) {
  std::vector<TrainingImage> images;
  for (std::uint32_t i = 0; i < 5; ++i) images.push_back(imageWithLandmarks(i, 50001 * i, 50001));
  const auto found = landmarksOf(mapOf(std::move(images)));
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found.front().points.size(), 125003U) << "every second of 250005";
  EXPECT_EQ(found.front().colors.size(), found.front().points.size());
  EXPECT_EQ(found.front().points.back().x, 4.0);
}

TEST(MapMessages, ThePathVisitsEveryImage) {
  const auto map = test::smallMap();
  const auto path = toPath(*map, "map");
  ASSERT_EQ(path.poses.size(), map->size());
  EXPECT_EQ(path.header.frame_id, "map");
  EXPECT_EQ(path.poses[7].pose.position.x, map->position_m(7).x());
  EXPECT_EQ(path.poses[7].pose.position.y, map->position_m(7).y());
}

TEST(MapMessages, MarkersDeleteTheOldOnesAndShowEverySession) {
  const auto markers = toMarkers(*test::smallMap(), "map").markers;
  ASSERT_EQ(markers.size(), 5U);
  EXPECT_EQ(markers[0].action, Marker::DELETEALL);
  std::size_t positions = 0;
  for (const Marker& marker : markers) {
    EXPECT_EQ(marker.header.frame_id, "map");
    if (marker.ns == "positions") positions += marker.points.size();
    if (marker.ns == "headings") {
      EXPECT_EQ(marker.points.size(), 10U);
    }
  }
  EXPECT_EQ(positions, 10U);
}

TEST(MapMessages, OfACityAtMost20000PositionsAreShown) {
  std::vector<TrainingImage> images(50001);
  for (std::size_t i = 0; i < images.size(); ++i) images[i].position_m.x() = static_cast<double>(i);
  MapHeader header = test::smallMap()->header();
  header.sessions = {{"one"}};
  const TrainingMap city(header, std::move(images));
  const auto path = toPath(city, "map");
  EXPECT_LE(path.poses.size(), 20000U);
  EXPECT_GT(path.poses.size(), 10000U);
  EXPECT_EQ(path.poses.back().pose.position.x, 49998.0);
  const auto markers = toMarkers(city, "map").markers;
  EXPECT_EQ(markers[1].points.size(), path.poses.size());
  EXPECT_EQ(markers[2].points.size(), 2 * path.poses.size());
}

}  // namespace
}  // namespace visual_localization
