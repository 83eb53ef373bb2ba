#include "node/message_conversions.h"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>
#include <sensor_msgs/point_cloud2_iterator.h>

namespace visual_localization {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

std_msgs::Header header() {
  std_msgs::Header header;
  header.frame_id = "map";
  header.stamp = ros::Time(1224840901, 250);
  return header;
}

Estimate someEstimate() {
  Estimate estimate;
  estimate.state = LocalizationState::kTracking;
  estimate.pose.position_m = {12.5, -3.25};
  estimate.pose.yaw_rad = 0.5 * M_PI;
  estimate.pose.covariance_m2 << 4.0, 0.5, 0.5, 1.0;
  estimate.pose.yaw_variance_rad2 = 0.04;
  estimate.pose.geodetic = {48.5, 9.05, 340.0};
  estimate.tracked.best = {0.25, 0.25, 31, true, 1.25};
  estimate.tracked.best_image = 7;
  estimate.comparisons = 12;
  estimate.tracked.spread_m = {3.0, 2.0};
  estimate.image.extract_ms = 10.0;
  estimate.image.match_ms = 20.0;
  estimate.update_ms = 1.5;
  return estimate;
}

std::vector<Particle> twoParticles() {
  Particle moving;
  moving.position_m = {1.0, 2.0};
  moving.velocity_m = {0.0, -0.5};
  moving.weight = 0.75;
  moving.kind = ParticleKind::kHighEnergy;
  Particle resting;
  resting.position_m = {-3.0, 4.0};
  resting.weight = 0.25;
  resting.kind = ParticleKind::kQuantum;
  return {moving, resting};
}

TEST(MessageConversions, YawTurnsAboutZ) {
  const auto north = quaternionFromYaw(0.5 * M_PI);
  EXPECT_NEAR(north.z, std::sqrt(0.5), 1e-12);
  EXPECT_NEAR(north.w, std::sqrt(0.5), 1e-12);
  EXPECT_EQ(north.x, 0.0);
  EXPECT_EQ(north.y, 0.0);
}

TEST(MessageConversions, PoseHoldsPositionHeadingAndCovariance) {
  const auto message = toPose(someEstimate(), header());
  EXPECT_EQ(message.header.frame_id, "map");
  EXPECT_EQ(message.header.stamp, header().stamp);
  EXPECT_EQ(message.pose.pose.position.x, 12.5);
  EXPECT_EQ(message.pose.pose.position.y, -3.25);
  EXPECT_NEAR(message.pose.pose.orientation.z, std::sqrt(0.5), 1e-12);
  EXPECT_EQ(message.pose.covariance[0], 4.0);
  EXPECT_EQ(message.pose.covariance[1], 0.5);
  EXPECT_EQ(message.pose.covariance[6], 0.5);
  EXPECT_EQ(message.pose.covariance[7], 1.0);
  EXPECT_EQ(message.pose.covariance[35], 0.04);
}

TEST(MessageConversions, FixIsTheSameEstimateInDegrees) {
  const auto message = toFix(someEstimate(), header());
  EXPECT_EQ(message.latitude, 48.5);
  EXPECT_EQ(message.longitude, 9.05);
  EXPECT_EQ(message.altitude, 340.0);
  EXPECT_EQ(message.position_covariance[0], 4.0);
  EXPECT_EQ(message.position_covariance[3], 0.5);
  EXPECT_EQ(message.position_covariance[4], 1.0);
  EXPECT_EQ(message.status.status, sensor_msgs::NavSatStatus::STATUS_FIX);
}

TEST(MessageConversions, NoFixWhileThePositionIsUnknown) {
  Estimate estimate = someEstimate();
  for (const auto state : {LocalizationState::kInitializing, LocalizationState::kRecovering}) {
    estimate.state = state;
    EXPECT_EQ(toFix(estimate, header()).status.status, sensor_msgs::NavSatStatus::STATUS_NO_FIX);
  }
}

TEST(MessageConversions, StatusNamesTheStateAndTheEvidence) {
  const auto message = toStatus(someEstimate(), header());
  EXPECT_EQ(message.state, LocalizationStatus::TRACKING);
  EXPECT_EQ(message.state_name, "TRACKING");
  EXPECT_EQ(message.best_matches, 31U);
  EXPECT_EQ(message.best_scale, 1.25);
  EXPECT_EQ(message.best_image, 7);
  EXPECT_EQ(message.sigma_x, 3.0);
  EXPECT_EQ(message.sigma_y, 2.0);
  EXPECT_EQ(message.update_ms, 1.5);
}

TEST(MessageConversions, StatusWithoutComparisonHasNoBestImage) {
  EXPECT_EQ(toStatus(Estimate{}, header()).best_image, -1);
}

TEST(MessageConversions, StatesAndKindsHaveTheNumbersOfTheMessages) {
  EXPECT_EQ(static_cast<int>(LocalizationState::kNoMap), LocalizationStatus::NO_MAP);
  EXPECT_EQ(static_cast<int>(LocalizationState::kInitializing), LocalizationStatus::INITIALIZING);
  EXPECT_EQ(static_cast<int>(LocalizationState::kTracking), LocalizationStatus::TRACKING);
  EXPECT_EQ(static_cast<int>(LocalizationState::kUncertain), LocalizationStatus::UNCERTAIN);
  EXPECT_EQ(static_cast<int>(LocalizationState::kRecovering), LocalizationStatus::RECOVERING);
  EXPECT_EQ(static_cast<int>(FeatureKind::kSift), LocalizationStatus::SIFT);
  EXPECT_EQ(static_cast<int>(FeatureKind::kGlobal), LocalizationStatus::GLOBAL);
  EXPECT_EQ(static_cast<int>(ParticleKind::kStandard), SwarmParticle::STANDARD);
  EXPECT_EQ(static_cast<int>(ParticleKind::kQuantum), SwarmParticle::QUANTUM);
  EXPECT_EQ(static_cast<int>(ParticleKind::kHighEnergy), SwarmParticle::HIGH_ENERGY);
}

TEST(MessageConversions, SwarmKeepsEveryParticle) {
  const auto message = toSwarm(twoParticles(), header());
  ASSERT_EQ(message.particles.size(), 2U);
  EXPECT_EQ(message.particles[0].kind, SwarmParticle::HIGH_ENERGY);
  EXPECT_EQ(message.particles[0].velocity.y, -0.5);
  EXPECT_EQ(message.particles[0].weight, 0.75);
  EXPECT_NEAR(message.particles[0].pose.orientation.z, -std::sqrt(0.5), 1e-12);
  EXPECT_EQ(message.particles[1].pose.orientation.w, 1.0);  // at rest
}

TEST(MessageConversions, PoseArrayAndCloudAgree) {
  const auto poses = toPoseArray(twoParticles(), header());
  const auto cloud = toPointCloud(twoParticles(), header());
  ASSERT_EQ(poses.poses.size(), 2U);
  ASSERT_EQ(cloud.width * cloud.height, 2U);
  sensor_msgs::PointCloud2ConstIterator<float> point(cloud, "x");
  sensor_msgs::PointCloud2ConstIterator<float> intensity(cloud, "intensity");
  for (const auto& pose : poses.poses) {
    EXPECT_EQ(static_cast<double>(point[0]), pose.position.x);
    EXPECT_EQ(static_cast<double>(point[1]), pose.position.y);
    ++point;
  }
  EXPECT_EQ(*intensity, 0.75F);
}

TEST(MessageConversions, AnEmptyCloudIsNoError) {
  EXPECT_EQ(toPointCloud({}, header()).data.size(), 0U);
  EXPECT_TRUE(toPoseArray({}, header()).poses.empty());
}

TEST(MessageConversions, WhatIsNotFiniteIsSeen) {
  EXPECT_TRUE(isFinite(someEstimate()));
  for (const double bad : {kNan, kInfinity, -kInfinity}) {
    Estimate estimate = someEstimate();
    estimate.pose.position_m.y() = bad;
    EXPECT_FALSE(isFinite(estimate));
    estimate = someEstimate();
    estimate.pose.covariance_m2(1, 0) = bad;
    EXPECT_FALSE(isFinite(estimate));
    estimate = someEstimate();
    estimate.pose.yaw_rad = bad;
    EXPECT_FALSE(isFinite(estimate));
    estimate = someEstimate();
    estimate.pose.geodetic.latitude_deg = bad;
    EXPECT_FALSE(isFinite(estimate));
    Particle particle;
    particle.weight = bad;
    EXPECT_FALSE(isFinite(particle));
  }
}

}  // namespace
}  // namespace visual_localization
