#include <gtest/gtest.h>

#include "node/markers.h"
#include "test/node/map_header.h"

namespace visual_localization {
namespace {

std_msgs::Header headerAt(double time_s) { return test::mapHeader(ros::Time(time_s)); }

Estimate placeAt(double east_m) {
  Estimate estimate;
  estimate.state = LocalizationState::kTracking;
  estimate.source = PoseSource::kPlace;
  estimate.pose.position_m = {east_m, 5.0};
  return estimate;
}

Estimate metricAt(double east_m) {
  Estimate estimate = placeAt(east_m);
  estimate.source = PoseSource::kMetric;
  estimate.metric = MetricPose();
  estimate.metric->base.translation() = Eigen::Vector3d(east_m, 5.0, 1.5);
  return estimate;
}

TEST(DrivenPath, HasTheMetricPosesWithHeightAndTheirStamps) {
  DrivenPath drive;
  for (int i = 0; i < 3; ++i) drive.add(metricAt(i), headerAt(10.0 + i));
  const nav_msgs::Path path = drive.toPath(headerAt(12.0));
  EXPECT_EQ(path.header.frame_id, "map");
  EXPECT_EQ(path.header.stamp, ros::Time(12.0));
  ASSERT_EQ(path.poses.size(), 3U);
  EXPECT_EQ(path.poses[1].pose.position.x, 1.0);
  EXPECT_EQ(path.poses[1].pose.position.z, 1.5);
  EXPECT_EQ(path.poses[1].header.stamp, ros::Time(11.0));
  EXPECT_EQ(path.poses[1].header.frame_id, "map");
}

TEST(DrivenPath, HasPlacesWhereThereAreNoLandmarks) {
  DrivenPath drive;
  drive.add(placeAt(1.0), headerAt(1.0));
  EXPECT_EQ(drive.toPath(headerAt(1.0)).poses.size(), 1U);
}

TEST(DrivenPath, LeavesOutWhatIsNotTracked) {
  DrivenPath drive;
  for (const auto state : {LocalizationState::kInitializing, LocalizationState::kUncertain,
                           LocalizationState::kRecovering, LocalizationState::kOffMap, LocalizationState::kNoMap}) {
    Estimate estimate = metricAt(1.0);
    estimate.state = state;
    drive.add(estimate, headerAt(1.0));
  }
  Estimate guess = placeAt(2.0);
  guess.images_since_metric = 1;  // in a map with landmarks
  drive.add(guess, headerAt(2.0));
  EXPECT_TRUE(drive.toPath(headerAt(2.0)).poses.empty());
}

TEST(DrivenPath, GrowsOnlyWhereTheRobotMoves) {
  DrivenPath drive;
  for (int i = 0; i < 100; ++i) drive.add(metricAt(0.001 * i), headerAt(i));
  EXPECT_EQ(drive.toPath(headerAt(100.0)).poses.size(), 1U);
  drive.add(metricAt(1.0), headerAt(100.0));
  EXPECT_EQ(drive.toPath(headerAt(100.0)).poses.size(), 2U);
}

TEST(DrivenPath, ForgetsTheOldestAndEverythingWhenTold) {
  DrivenPath drive;
  for (std::size_t i = 0; i < DrivenPath::kMost + 10; ++i) {
    drive.add(metricAt(static_cast<double>(i)), headerAt(static_cast<double>(i)));
  }
  const nav_msgs::Path path = drive.toPath(headerAt(0.0));
  ASSERT_EQ(path.poses.size(), DrivenPath::kMost);
  EXPECT_EQ(path.poses.front().pose.position.x, 10.0);
  drive.clear();
  EXPECT_TRUE(drive.toPath(headerAt(0.0)).poses.empty());
}

}  // namespace
}  // namespace visual_localization
