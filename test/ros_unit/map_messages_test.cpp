#include "visual_localization/ros/map_messages.h"

#include <gtest/gtest.h>

#include "test/ros_unit/small_map.h"

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
  std::size_t places = 0;
  for (const Marker& marker : markers) {
    EXPECT_EQ(marker.header.frame_id, "map");
    if (marker.ns == "places") places += marker.points.size();
    if (marker.ns == "headings") {
      EXPECT_EQ(marker.points.size(), 10U);
    }
  }
  EXPECT_EQ(places, 10U);
}

}  // namespace
}  // namespace visual_localization
