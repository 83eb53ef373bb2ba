#include "node/drive_markers.h"

#include <algorithm>
#include <string>

#include <gtest/gtest.h>

#include "node/drawings.h"
#include "test/node/map_header.h"

namespace visual_localization {
namespace {

using visualization_msgs::Marker;

Estimate estimateAt(double east_m, LocalizationState state) {
  Estimate estimate;
  estimate.state = state;
  estimate.pose.position_m = {east_m, 5.0};
  estimate.pose.covariance_m2 = Eigen::Vector2d(4.0, 1.0).asDiagonal();
  estimate.why = {StateReason::kPlacesAlike, 0.5, {80.0, 3.0}};
  return estimate;
}

Marker markerOf(const DriveMarkers& drive, const std::string& name) {
  for (const Marker& marker : drive.toMarkers(test::mapHeader(ros::Time(1.0))).markers) {
    if (marker.ns == name) return marker;
  }
  ADD_FAILURE() << name;
  return {};
}

TEST(DriveMarkers, AreNoneBeforeAnImage) {
  EXPECT_TRUE(DriveMarkers().toMarkers(test::mapHeader(ros::Time(1.0))).markers.empty());
}

TEST(DriveMarkers, ConfirmedAndDoubtfulWayDiffer) {
  DriveMarkers drive;
  for (int i = 0; i < 4; ++i) drive.add(estimateAt(i, LocalizationState::kTracking));
  EXPECT_EQ(markerOf(drive, "doubtful way").action, Marker::DELETE);
  for (int i = 4; i < 6; ++i) drive.add(estimateAt(i, LocalizationState::kUncertain));
  const Marker confirmed = markerOf(drive, "confirmed way");
  const Marker doubtful = markerOf(drive, "doubtful way");
  EXPECT_EQ(confirmed.points.size(), 6U);
  ASSERT_EQ(doubtful.points.size(), 4U);
  EXPECT_EQ(doubtful.points.front().x, 3.0);
  EXPECT_GT(confirmed.scale.x, doubtful.scale.x);
  EXPECT_EQ(doubtful.colors.size(), doubtful.points.size());
  EXPECT_NE(doubtful.colors.front().r, confirmed.colors.front().r);
}

TEST(DriveMarkers, NoLineCrossesAJump) {
  DriveMarkers drive;
  drive.add(estimateAt(0.0, LocalizationState::kTracking));
  drive.add(estimateAt(1.0, LocalizationState::kTracking));
  drive.add(estimateAt(2.0 + DriveMarkers::kJump_m, LocalizationState::kTracking));
  EXPECT_EQ(markerOf(drive, "confirmed way").points.size(), 2U);
  drive.clear();
  EXPECT_EQ(markerOf(drive, "confirmed way").action, Marker::DELETE);
}

TEST(DriveMarkers, OutlineIsOfThreeSigma) {
  DriveMarkers drive;
  drive.add(estimateAt(10.0, LocalizationState::kTracking));
  const Marker outline = markerOf(drive, "three sigma");
  const auto [west, east] = std::minmax_element(outline.points.begin(), outline.points.end(),
                                                [](const auto& a, const auto& b) { return a.x < b.x; });
  EXPECT_NEAR(west->x, 4.0, 0.05);
  EXPECT_NEAR(east->x, 16.0, 0.05);
}

TEST(DriveMarkers, WordsAndColourAreThoseOfTheState) {
  DriveMarkers drive;
  drive.add(estimateAt(10.0, LocalizationState::kUncertain));
  EXPECT_EQ(markerOf(drive, "reason").text.find("UNCERTAIN\n"), 0U);
  EXPECT_NE(markerOf(drive, "reason").text.find("x = 80"), std::string::npos);
  const float red = markerOf(drive, "robot").color.r;
  drive.stateIs(LocalizationState::kInitializing, {StateReason::kCameraSilent, 4.0});
  EXPECT_NE(markerOf(drive, "reason").text.find("No image comes"), std::string::npos);
  EXPECT_NE(markerOf(drive, "robot").color.r, red);
  EXPECT_EQ(markerOf(drive, "robot").pose.position.x, 10.0);
}

TEST(InLines, BreakAtSpacesAndWithinLongWords) {
  EXPECT_EQ(inLines("one two three", 7), (std::vector<std::string>{"one two", "three"}));
  EXPECT_EQ(inLines("abcdefgh", 3), (std::vector<std::string>{"abc", "def", "gh"}));
  EXPECT_EQ(inLines("", 3), std::vector<std::string>{""});
}

}  // namespace
}  // namespace visual_localization
