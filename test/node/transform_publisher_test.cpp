#include <cmath>

#include <gtest/gtest.h>

#include "node/localizer_publisher.h"

namespace visual_localization {
namespace {

tf2::Transform transform(double x_m, double y_m, double yaw_rad) {
  return tf2::Transform(tf2::Quaternion(tf2::Vector3(0.0, 0.0, 1.0), yaw_rad), tf2::Vector3(x_m, y_m, 0.0));
}

TEST(OdomInMap, OdometryThenLeadsToTheEstimate) {
  const auto base_in_map = transform(10.0, 20.0, 1.2);
  const auto base_in_odom = transform(-3.0, 0.5, -0.7);
  const auto again = odomInMap(base_in_map, base_in_odom) * base_in_odom;
  EXPECT_NEAR((again.getOrigin() - base_in_map.getOrigin()).length(), 0.0, 1e-9);
  EXPECT_NEAR(again.getRotation().angleShortestPath(base_in_map.getRotation()), 0.0, 1e-6);
}

TEST(OdomInMap, AtTheStartOfOdometryItIsTheRobot) {
  const auto odom_in_map = odomInMap(transform(5.0, 6.0, 0.0), transform(0.0, 0.0, 0.0));
  EXPECT_NEAR(odom_in_map.getOrigin().x(), 5.0, 1e-12);
  EXPECT_NEAR(odom_in_map.getOrigin().y(), 6.0, 1e-12);
}

Estimate estimateOf(PoseSource source, LocalizationState state, std::optional<bool> verified) {
  Estimate estimate;
  estimate.source = source;
  estimate.state = state;
  estimate.evidence.verified = verified;
  return estimate;
}

TEST(MovesRobot, OnlyAVerifiedPoseDoesWhereLandmarksCanVerifyIt) {
  constexpr bool kMetricOnly = true;
  using State = LocalizationState;
  EXPECT_TRUE(movesRobot(estimateOf(PoseSource::kMetric, State::kTracking, true), kMetricOnly));
  EXPECT_FALSE(movesRobot(estimateOf(PoseSource::kPlace, State::kTracking, false), kMetricOnly));
  for (const State state : {State::kInitializing, State::kUncertain, State::kRecovering, State::kOffMap}) {
    EXPECT_FALSE(movesRobot(estimateOf(PoseSource::kMetric, state, false), kMetricOnly)) << toString(state);
  }
}

TEST(MovesRobot, NoPlaceDoesWhenTheImagesContradictTheCalibration) {
  Estimate estimate = estimateOf(PoseSource::kPlace, LocalizationState::kTracking, std::nullopt);
  estimate.camera_contradicted = true;
  EXPECT_FALSE(movesRobot(estimate, true));
  EXPECT_TRUE(movesRobot(estimate, false));
}

TEST(MovesRobot, EveryPoseDoesInAMapOfPlacesAndWhenAsked) {
  for (const auto state : {LocalizationState::kTracking, LocalizationState::kRecovering}) {
    EXPECT_TRUE(movesRobot(estimateOf(PoseSource::kPlace, state, std::nullopt), true));
    EXPECT_TRUE(movesRobot(estimateOf(PoseSource::kPlace, state, false), false));
  }
}

}  // namespace
}  // namespace visual_localization
