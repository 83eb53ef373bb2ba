#include <gtest/gtest.h>

#include "node/message_conversions.h"
#include "test/node/small_map.h"

namespace visual_localization {
namespace {

using visualization_msgs::Marker;

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
