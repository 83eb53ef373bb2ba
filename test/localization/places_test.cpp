#include "localization/places.h"

#include <cmath>
#include <cstddef>
#include <memory>
#include <vector>

#include <gtest/gtest.h>

#include "test/support/stamps.h"
#include "visual_localization/map/training_map.h"

namespace visual_localization {
namespace {

using test::kSecond_ns;

constexpr double kSpacing_m = 1.0;
constexpr double kGap_m = 5.0;

std::unique_ptr<const TrainingMap> mapAt(const std::vector<TrainingPose>& poses, std::size_t sessions = 1) {
  MapHeader header;
  header.image_size = {320, 240};
  header.sessions.resize(sessions);
  std::vector<TrainingImage> images(poses.size());
  for (std::size_t i = 0; i < poses.size(); ++i) static_cast<TrainingPose&>(images[i]) = poses[i];
  return std::make_unique<const TrainingMap>(header, std::move(images));
}

/// An image a metre to the east.
void driveOn(double from_m, double to_m, int session, std::vector<TrainingPose>& poses) {
  for (double x_m = from_m; x_m <= to_m; x_m += kSpacing_m) {
    const auto stamp_ns = static_cast<std::int64_t>(1000 + poses.size()) * kSecond_ns;
    poses.push_back({stamp_ns, session, {x_m, 0.2 * session}, 0.0});
  }
}

std::size_t countBeyond(const Places& places, std::size_t image) {
  const auto [first, last] = places.beyond(image);
  return last - first;
}

TEST(Places, AStreetGoesOnBeyondBothEnds) {
  std::vector<TrainingPose> poses;
  driveOn(0.0, 99.0, 0, poses);
  const auto map = mapAt(poses);
  const Places places(*map, kSpacing_m, kGap_m);
  EXPECT_EQ(places.size(), 180U);
  const auto [first, last] = places.beyond(99);
  ASSERT_EQ(last - first, 40U);
  EXPECT_FALSE(places.hasImage(first));
  EXPECT_EQ(places.image(first), 99U);
  EXPECT_NEAR((places.position_m(first) - Eigen::Vector2d(100.0, 0.0)).norm(), 0.0, 1e-9);
  EXPECT_NEAR((places.position_m(last - 1) - Eigen::Vector2d(139.0, 0.0)).norm(), 0.0, 1e-9);
  EXPECT_NEAR((places.position_m(places.beyond(0).first) - Eigen::Vector2d(-1.0, 0.0)).norm(), 0.0, 1e-9);
  EXPECT_EQ(countBeyond(places, 50), 0U);
  EXPECT_TRUE(places.hasImage(50));
  EXPECT_EQ(places.nearest({105.2, 0.0}).image, first + 5);
}

TEST(Places, OfADenseAndOfASparsePath) {
  std::vector<TrainingPose> poses;
  driveOn(0.0, 29.0, 0, poses);
  const auto map = mapAt(poses);
  EXPECT_EQ(countBeyond(Places(*map, 0.1, kGap_m), 29), 100U);
  EXPECT_EQ(countBeyond(Places(*map, 10.0, kGap_m), 29), 20U);
}

TEST(Places, ARoundThatClosesHasNoEnd) {
  std::vector<TrainingPose> poses;
  const double radius_m = 100.0 / (2.0 * M_PI);
  for (int i = 0; i < 100; ++i) {
    const double angle_rad = i / radius_m;
    poses.push_back({(1000 + i) * kSecond_ns, 0, radius_m * Eigen::Vector2d(std::cos(angle_rad), std::sin(angle_rad)),
                     angle_rad + M_PI / 2.0});
  }
  const auto map = mapAt(poses);
  EXPECT_EQ(Places(*map, kSpacing_m, kGap_m).size(), 100U);
}

TEST(Places, AGapOfASessionIsAnEndOnEitherSide) {
  std::vector<TrainingPose> poses;
  driveOn(0.0, 29.0, 0, poses);
  driveOn(40.0, 69.0, 0, poses);
  const auto map = mapAt(poses);
  const Places places(*map, kSpacing_m, kGap_m);
  EXPECT_EQ(countBeyond(places, 29), 10U) << "up to the image on the other side";
  EXPECT_EQ(countBeyond(places, 30), 10U);
  EXPECT_NEAR(places.position_m(places.beyond(30).first).x(), 39.0, 1e-9);
}

TEST(Places, AnImageThatIsMissingIsNoEnd) {
  std::vector<TrainingPose> poses;
  driveOn(0.0, 29.0, 0, poses);
  driveOn(34.0, 69.0, 0, poses);
  const auto map = mapAt(poses);
  EXPECT_EQ(countBeyond(Places(*map, kSpacing_m, kGap_m), 29), 0U);
}

TEST(Places, AnotherSessionLeadsOn) {
  std::vector<TrainingPose> poses;
  driveOn(0.0, 29.0, 0, poses);
  driveOn(20.0, 60.0, 1, poses);
  const auto map = mapAt(poses, 2);
  const Places places(*map, kSpacing_m, kGap_m);
  EXPECT_EQ(countBeyond(places, 29), 0U);
  EXPECT_EQ(countBeyond(places, 30), 0U) << "behind the second session's first image";
  EXPECT_EQ(countBeyond(places, 70), 40U);
}

TEST(Places, OneThatFacesTheOtherWayDoesNot) {
  std::vector<TrainingPose> poses;
  driveOn(0.0, 29.0, 0, poses);
  driveOn(20.0, 60.0, 1, poses);
  for (TrainingPose& pose : poses) pose.yaw_rad = pose.session == 1 ? M_PI : 0.0;
  const auto map = mapAt(poses, 2);
  EXPECT_EQ(countBeyond(Places(*map, kSpacing_m, kGap_m), 29), 40U);
}

}  // namespace
}  // namespace visual_localization
