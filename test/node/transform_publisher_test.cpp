#include <cmath>
#include <tuple>

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

constexpr double kSigma_m = 0.2;
constexpr double kSigma_rad = 0.05;
const tf2::Transform kFarInOdom = transform(800.0, -300.0, 2.0);  // of a robot that has driven for long

/// From where `odom_in_map` has the robot, at kFarInOdom.
double apart_m(const tf2::Transform& shown, const tf2::Transform& odom_in_map) {
  return ((shown * kFarInOdom).getOrigin() - (odom_in_map * kFarInOdom).getOrigin()).length();
}

/// odom_in_map that has the robot, at kFarInOdom, at this place of the map.
tf2::Transform withRobotAt(double x_m, double y_m, double yaw_rad) {
  return odomInMap(transform(x_m, y_m, yaw_rad), kFarInOdom);
}

TEST(SlidingCorrection, BeginsWhereThePoseIs) {
  SlidingCorrection correction(0.5, {});
  const auto target = withRobotAt(10.0, 5.0, 1.0);
  correction.aimAt(target, kFarInOdom, kSigma_m, kSigma_rad);
  EXPECT_LT(apart_m(correction.after(0.0, kFarInOdom), target), 1e-6);
}

TEST(SlidingCorrection, ASmallOneMovesTheRobotLittleByLittle) {
  SlidingCorrection correction(0.5, {});
  const auto before = withRobotAt(10.0, 5.0, 1.0);
  const auto target = withRobotAt(10.4, 5.3, 1.1);
  correction.aimAt(before, kFarInOdom, kSigma_m, kSigma_rad);
  correction.after(0.0, kFarInOdom);
  correction.aimAt(target, kFarInOdom, kSigma_m, kSigma_rad);
  tf2::Transform shown = before;
  double left_m = 0.5;
  for (int k = 0; k < 25; ++k) {
    const tf2::Transform next = correction.after(0.02, kFarInOdom);
    EXPECT_LT(apart_m(next, shown), 0.021) << k;
    left_m *= std::exp(-0.02 / 0.5);
    EXPECT_NEAR(apart_m(next, target), left_m, 0.002) << k;
    shown = next;
  }
  EXPECT_NEAR(apart_m(shown, target), 0.5 * std::exp(-1.0), 0.003);
  EXPECT_NEAR((shown * kFarInOdom).getRotation().angleShortestPath((target * kFarInOdom).getRotation()),
              0.1 * std::exp(-1.0), 1e-3);
  EXPECT_LT(apart_m(correction.after(100.0, kFarInOdom), target), 1e-6);
}

TEST(SlidingCorrection, OneBeyondThreeSigmasMovesItAtOnce) {
  for (const auto& [x_m, yaw_rad, at_once] :
       {std::tuple(10.59, 1.0, false), {10.61, 1.0, true}, {10.0, 1.149, false}, {10.0, 0.849, true}}) {
    SlidingCorrection correction(0.5, {});
    correction.aimAt(withRobotAt(10.0, 5.0, 1.0), kFarInOdom, kSigma_m, kSigma_rad);
    correction.after(0.0, kFarInOdom);
    const auto target = withRobotAt(x_m, 5.0, yaw_rad);
    correction.aimAt(target, kFarInOdom, kSigma_m, kSigma_rad);
    const tf2::Transform shown = correction.after(0.02, kFarInOdom);
    const double turned_rad = (shown * kFarInOdom).getRotation().angleShortestPath((target * kFarInOdom).getRotation());
    EXPECT_EQ(apart_m(shown, target) < 1e-6 && turned_rad < 1e-6, at_once) << x_m << ", " << yaw_rad;
  }
}

// Odometry of a robot on a hill, which the planar pose in the map does not know.
TEST(SlidingCorrection, HeightsAndTiltsAreFollowedAndNoReasonToBeElsewhere) {
  SlidingCorrection correction(0.5, {});
  const auto climbing = [](double x_m) {
    tf2::Quaternion tilted;
    tilted.setRPY(0.2, -0.1, 0.3);
    return tf2::Transform(tilted, tf2::Vector3(x_m, 2.0, 0.3 * x_m));
  };
  tf2::Transform shown;
  for (int image = 0; image < 20; ++image) {
    const tf2::Transform base_in_odom = climbing(image);
    const tf2::Transform base_in_map = transform(5.0 + image, 1.0, 0.8);
    const tf2::Transform target = odomInMap(base_in_map, base_in_odom);
    correction.aimAt(target, base_in_odom, kSigma_m, kSigma_rad);
    for (int k = 0; k < 50; ++k) shown = correction.after(0.02, base_in_odom);
    const tf2::Transform base_shown = shown * base_in_odom;
    EXPECT_LT((base_shown.getOrigin() - base_in_map.getOrigin()).length(), 0.1) << image;
    EXPECT_LT(base_shown.getRotation().angleShortestPath(base_in_map.getRotation()), 0.01) << image;
  }
  const tf2::Transform target = odomInMap(transform(24.0, 1.0, 0.8), climbing(19.5));
  correction.aimAt(target, climbing(19.5), kSigma_m, kSigma_rad);
  const tf2::Transform base = correction.after(0.02, climbing(19.5)) * climbing(19.5);
  EXPECT_GT((base.getOrigin() - (target * climbing(19.5)).getOrigin()).length(), 1e-3) << "it slides";
}

TEST(SlidingCorrection, AfterALongWayByOdometryALargerOneSlidesIn) {
  for (const double way_m : {0.0, 40.0}) {
    SlidingCorrection correction(0.5, {});
    const auto straight = transform(0.0, 0.0, 0.0);
    correction.aimAt(straight, straight, kSigma_m, kSigma_rad);
    for (double x_m = 0.0; x_m <= way_m; x_m += 1.0) correction.after(0.02, transform(x_m, 0.0, 0.0));
    const auto base_in_odom = transform(way_m, 0.0, 0.0);
    const auto target = transform(0.0, 2.0, 0.0);  // 5 % of 40 m, ten times the pose's own deviation
    correction.aimAt(target, base_in_odom, kSigma_m, kSigma_rad);
    const double left_m = (correction.after(0.02, base_in_odom).getOrigin() - target.getOrigin()).length();
    EXPECT_EQ(left_m < 1e-6, way_m == 0.0) << way_m;
  }
}

TEST(SlidingCorrection, SlidesByWhatOdometryIsSaidToDrift) {
  const auto slides = [](const OdometryConfig& odometry, const tf2::Transform& target) {
    SlidingCorrection correction(0.5, {});
    correction.configure(odometry);
    const auto straight = transform(0.0, 0.0, 0.0);
    correction.aimAt(straight, straight, kSigma_m, kSigma_rad);
    for (double x_m = 0.0; x_m <= 20.0; x_m += 1.0) correction.after(0.02, transform(x_m, 0.0, 0.0));
    const auto base_in_odom = transform(20.0, 0.0, 0.0);
    const auto odom_in_map = odomInMap(target, base_in_odom);
    correction.aimAt(odom_in_map, base_in_odom, kSigma_m, kSigma_rad);
    const auto left = odom_in_map.inverseTimes(correction.after(0.02, base_in_odom));
    return (left * base_in_odom).getOrigin().distance(base_in_odom.getOrigin()) > 1e-6 ||
           left.getRotation().getAngleShortestPath() > 1e-6;
  };
  OdometryConfig wheels;
  const auto aside = transform(20.0, 4.0, 0.0);
  wheels.distance_sigma = 0.01;
  EXPECT_FALSE(slides(wheels, aside));
  wheels.distance_sigma = 0.5;
  EXPECT_TRUE(slides(wheels, aside));
  const auto turned = transform(20.0, 0.0, 0.8);
  wheels.turn_sigma_rad_m = 0.001;
  EXPECT_FALSE(slides(wheels, turned));
  wheels.turn_sigma_rad_m = 0.1;
  EXPECT_TRUE(slides(wheels, turned));
}

TEST(SlidingCorrection, WithoutSmoothingEachMovesItAtOnce) {
  SlidingCorrection correction(0.0, {});
  for (const double x_m : {10.0, 10.1, 50.0}) {
    const auto target = withRobotAt(x_m, 5.0, 1.0);
    correction.aimAt(target, kFarInOdom, kSigma_m, kSigma_rad);
    EXPECT_LT(apart_m(correction.after(0.02, kFarInOdom), target), 1e-6) << x_m;
  }
}

TEST(SlidingCorrection, LeavesTheMotionToOdometry) {
  SlidingCorrection correction(0.5, {});
  const auto odom_in_map = withRobotAt(10.0, 5.0, 1.0);
  correction.aimAt(odom_in_map, kFarInOdom, kSigma_m, kSigma_rad);
  for (int k = 0; k < 10; ++k) {
    const tf2::Transform base_in_odom = kFarInOdom * transform(0.3 * k, 0.0, 0.1 * k);
    const tf2::Transform base_in_map = correction.after(0.02, base_in_odom) * base_in_odom;
    EXPECT_LT((base_in_map.getOrigin() - (odom_in_map * base_in_odom).getOrigin()).length(), 1e-6) << k;
  }
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
