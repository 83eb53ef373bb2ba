#include <functional>
#include <limits>
#include <stdexcept>
#include <string>

#include <gtest/gtest.h>

#include "node/shared_localizer.h"
#include "test/support/refusal.h"

namespace visual_localization {
namespace {

using Pose = geometry_msgs::PoseWithCovarianceStamped;

Pose goodPose() {
  Pose pose;
  pose.header.frame_id = "map";
  pose.pose.pose.position.x = 10.0;
  pose.pose.pose.position.y = -20.0;
  pose.pose.pose.orientation.w = 1.0;
  pose.pose.covariance[0] = 4.0;
  pose.pose.covariance[1] = 1.0;
  pose.pose.covariance[6] = 1.0;
  pose.pose.covariance[7] = 9.0;
  return pose;
}

/// Of a good pose after `spoil`, as a running node gives it.
std::string refusalOfPose(const std::function<void(Pose&)>& spoil) {
  Pose pose = goodPose();
  spoil(pose);
  return test::refusalOf<std::invalid_argument>(
      [&] { SharedLocalizer{LocalizerConfig{}}.relocalizeAt(guessFrom(pose, "map")); });
}

TEST(InitialPose, TakesPositionAndItsCovariance) {
  const auto guess = guessFrom(goodPose(), "map");
  EXPECT_EQ(guess.mean_m, Eigen::Vector2d(10.0, -20.0));
  EXPECT_EQ(guess.covariance_m2, (Eigen::Matrix2d() << 4.0, 1.0, 1.0, 9.0).finished());
}

TEST(InitialPose, ALeadingSlashIsTheSameFrame) {
  EXPECT_EQ(refusalOfPose([](Pose& pose) { pose.header.frame_id = "/map"; }), "accepted");
}

TEST(InitialPose, ZeroCovarianceIsAPosition) {
  EXPECT_EQ(refusalOfPose([](Pose& pose) { pose.pose.covariance.assign(0.0); }), "accepted");
}

TEST(InitialPose, AnotherFrameIsRefused) {
  EXPECT_NE(refusalOfPose([](Pose& pose) { pose.header.frame_id = "odom"; }).find("'odom'"), std::string::npos);
  EXPECT_NE(refusalOfPose([](Pose& pose) { pose.header.frame_id = ""; }), "accepted");
}

TEST(InitialPose, AFrameOfSeveralLinesIsNamedInOne) {
  const std::string reason =
      refusalOfPose([](Pose& pose) { pose.header.frame_id = "a\nb" + std::string(100'000, 'x'); });
  EXPECT_EQ(reason.find('\n'), std::string::npos);
  EXPECT_LT(reason.size(), 200U);
}

TEST(InitialPose, NumbersThatAreNotFiniteAreRefused) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  EXPECT_NE(refusalOfPose([](Pose& pose) { pose.pose.pose.position.x = kNan; }), "accepted");
  EXPECT_NE(refusalOfPose([](Pose& pose) { pose.pose.pose.position.y = kInfinity; }), "accepted");
  EXPECT_NE(refusalOfPose([](Pose& pose) { pose.pose.pose.orientation.z = kNan; }), "accepted");
  EXPECT_NE(refusalOfPose([](Pose& pose) { pose.pose.covariance[7] = kNan; }), "accepted");
  EXPECT_NE(refusalOfPose([](Pose& pose) { pose.pose.covariance[35] = kInfinity; }), "accepted");
}

TEST(InitialPose, WhatIsLargerThanAnyLocalMapIsRefused) {
  EXPECT_NE(refusalOfPose([](Pose& pose) { pose.pose.pose.position.x = 1e300; }).find("1000 km"), std::string::npos);
  EXPECT_NE(refusalOfPose([](Pose& pose) { pose.pose.covariance[0] = 1e300; }).find("1000 km"), std::string::npos);
}

TEST(InitialPose, CovarianceMustBePositiveSemiDefinite) {
  EXPECT_NE(refusalOfPose([](Pose& pose) { pose.pose.covariance[0] = -1.0; }).find("semi-definite"), std::string::npos);
  EXPECT_NE(refusalOfPose([](Pose& pose) { pose.pose.covariance[1] = pose.pose.covariance[6] = 10.0; }), "accepted");
  EXPECT_NE(refusalOfPose([](Pose& pose) { pose.pose.covariance[1] = 0.5; }).find("symmetric"), std::string::npos);
}

TEST(InitialPose, RoundingOfACovarianceIsNoFault) {
  EXPECT_EQ(refusalOfPose([](Pose& pose) { pose.pose.covariance[1] += 1e-7; }), "accepted");
  EXPECT_EQ(refusalOfPose([](Pose& pose) { pose.pose.covariance[0] = pose.pose.covariance[7] = 1.0 - 1e-7; }),
            "accepted");
}

}  // namespace
}  // namespace visual_localization
