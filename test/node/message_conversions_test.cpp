#include "node/message_conversions.h"

#include <cmath>
#include <functional>
#include <limits>

#include <Eigen/Eigenvalues>
#include <gtest/gtest.h>
#include <sensor_msgs/point_cloud2_iterator.h>

#include "test/node/map_header.h"

namespace visual_localization {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

std_msgs::Header header() { return test::mapHeader({1224840901, 250}); }

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
  estimate.session = "sunny_1";
  estimate.comparisons = 12;
  estimate.tracked.spread_m = {3.0, 2.0};
  estimate.image.extract_ms = 10.0;
  estimate.image.match_ms = 20.0;
  estimate.update_ms = 1.5;
  return estimate;
}

/// A camera that looks north, 10 degrees downwards.
Estimate metricEstimate() {
  Estimate estimate = someEstimate();
  estimate.source = PoseSource::kMetric;
  MetricPose metric;
  metric.camera.position_m = {12.5, -3.25, 1.5};
  metric.camera.rotation = Eigen::AngleAxisd(-10.0 * M_PI / 180.0, Eigen::Vector3d::UnitX()) * levelCamera(0.5 * M_PI);
  metric.base = SensorMount().baseInMap(metric.camera);
  metric.covariance.diagonal() << 0.0009, 0.0004, 0.0016, 1e-5, 2e-5, 3e-5;
  metric.covariance(0, 5) = metric.covariance(5, 0) = 1e-5;
  metric.map_covariance.diagonal() << 0.04, 0.04, 0.09, 1e-6, 1e-6, 4e-6;
  metric.inliers = 87;
  metric.reprojection_px = 0.75;
  estimate.metric = metric;
  return estimate;
}

/// Each that is not finite must be seen.
std::vector<std::function<double&(MetricPose&)>> numbersOf() {
  return {[](MetricPose& pose) -> double& { return pose.base.translation().z(); },
          [](MetricPose& pose) -> double& { return pose.base.linear()(1, 2); },
          [](MetricPose& pose) -> double& { return pose.covariance(2, 4); },
          [](MetricPose& pose) -> double& { return pose.map_covariance(5, 5); },
          [](MetricPose& pose) -> double& { return pose.reprojection_px; }};
}

Eigen::Matrix3d matrixOf(const geometry_msgs::Quaternion& rotation) {
  return Eigen::Quaterniond(rotation.w, rotation.x, rotation.y, rotation.z).toRotationMatrix();
}

using Covariance = Eigen::Matrix<double, 6, 6, Eigen::RowMajor>;

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

TEST(MessageConversions, ALevelCameraIsARobotThatLooksTheSameWay) {
  for (const double yaw_rad : {0.0, 0.5 * M_PI, -2.0, M_PI}) {
    const Eigen::Matrix3d body = SensorMount().baseInMap({levelCamera(yaw_rad), {}}).linear();
    EXPECT_LT((body - matrixOf(quaternionFromYaw(yaw_rad))).norm(), 1e-12) << yaw_rad;
  }
}

TEST(MessageConversions, ATiltedCameraKeepsItsHeadingAndShowsItsTilt) {
  const Estimate estimate = metricEstimate();
  const Eigen::Matrix3d body = matrixOf(toPose(estimate, header()).pose.pose.orientation);
  const Eigen::Vector3d ahead = body.col(0);
  EXPECT_LT((ahead - estimate.metric->camera.ahead()).norm(), 1e-12);
  EXPECT_NEAR(std::atan2(ahead.y(), ahead.x()), 0.5 * M_PI, 1e-12);
  EXPECT_NEAR(std::asin(ahead.z()), -10.0 * M_PI / 180.0, 1e-12);  // nose down
  EXPECT_NEAR(body(2, 1), 0.0, 1e-12);                             // left stays level
  EXPECT_GT(body(2, 2), 0.0);                                      // and up is up
}

TEST(MessageConversions, AMetricPoseHasItsHeightAndTheCovarianceOfPoseAndMap) {
  const Estimate estimate = metricEstimate();
  const auto message = toPose(estimate, header());
  EXPECT_EQ(message.pose.pose.position.x, 12.5);
  EXPECT_EQ(message.pose.pose.position.y, -3.25);
  EXPECT_EQ(message.pose.pose.position.z, 1.5);
  const Covariance covariance = Eigen::Map<const Covariance>(message.pose.covariance.data());
  const Covariance expected = estimate.metric->covariance + estimate.metric->map_covariance;
  EXPECT_LT((covariance - expected).cwiseAbs().maxCoeff(), 2e-6);  // the floors: 1 mm, 0.1 mrad
  EXPECT_EQ(covariance(0, 5), 1e-5);
}

TEST(MessageConversions, AMetricCovarianceCanBeInvertedWhateverComes) {
  Estimate estimate = metricEstimate();
  estimate.metric->covariance.setZero();
  estimate.metric->map_covariance.setZero();
  estimate.metric->covariance(0, 1) = 1e-9;  // rounding: not symmetric
  const auto message = toPose(estimate, header());
  const Covariance covariance = Eigen::Map<const Covariance>(message.pose.covariance.data());
  EXPECT_EQ((covariance - covariance.transpose()).norm(), 0.0);
  EXPECT_GT(Eigen::SelfAdjointEigenSolver<Covariance>(covariance).eigenvalues().minCoeff(), 0.0);
}

TEST(MessageConversions, AFilterFusesWhatAnImageSaysInRelationToTheMap) {
  Estimate estimate = metricEstimate();
  estimate.state = LocalizationState::kTracking;
  const auto message = toMetricPose(estimate, header());
  ASSERT_TRUE(message);
  EXPECT_EQ(message->header.stamp, header().stamp);
  EXPECT_EQ(message->pose.pose, toPose(estimate, header()).pose.pose);
  const Covariance covariance = Eigen::Map<const Covariance>(message->pose.covariance.data());
  EXPECT_LT((covariance - estimate.metric->covariance).cwiseAbs().maxCoeff(), 2e-6);
}

TEST(MessageConversions, AFilterIsNotGivenWhatNobodyConfirms) {
  Estimate estimate = metricEstimate();
  for (const LocalizationState state : {LocalizationState::kUncertain, LocalizationState::kInitializing,
                                        LocalizationState::kRecovering, LocalizationState::kOffMap}) {
    estimate.state = state;
    EXPECT_FALSE(toMetricPose(estimate, header())) << toString(state);
  }
  estimate.state = LocalizationState::kTracking;
  estimate.metric.reset();  // of a place, or predicted
  EXPECT_FALSE(toMetricPose(estimate, header()));
}

TEST(MessageConversions, TheFixOfAMetricPoseHasItsCovariance) {
  const auto pose = toPose(metricEstimate(), header());
  const auto fix = toFix(metricEstimate(), header());
  EXPECT_EQ(fix.position_covariance[0], pose.pose.covariance[0]);
  EXPECT_EQ(fix.position_covariance[1], pose.pose.covariance[1]);
  EXPECT_EQ(fix.position_covariance[4], pose.pose.covariance[7]);
  EXPECT_GE(fix.position_covariance[8], 1e6);  // the altitude stays unknown
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
  EXPECT_EQ(message.session, "sunny_1");
  EXPECT_EQ(message.best_matches, 31U);
  EXPECT_EQ(message.best_scale, 1.25);
  EXPECT_EQ(message.best_image, 7);
  EXPECT_EQ(message.sigma_x, 3.0);
  EXPECT_EQ(message.sigma_y, 2.0);
  EXPECT_EQ(message.update_ms, 1.5);
}

TEST(MessageConversions, StatusWithoutComparisonHasNoBestImage) {
  const auto message = toStatus(Estimate{}, header());
  EXPECT_EQ(message.best_image, -1);
  EXPECT_EQ(message.source_name, "NONE");
  for (const double unknown : {message.sigma_position, message.sigma_heading, message.mean_grey, message.probability,
                               message.min_probability, message.off_map, message.rival_x, message.rival_probability}) {
    EXPECT_TRUE(std::isnan(unknown));
  }
  EXPECT_EQ(message.rival_image, -1);
}

TEST(MessageConversions, StatusTellsTheImageFromTheMapInAMetricPose) {
  const auto message = toStatus(metricEstimate(), header());
  EXPECT_EQ(message.source, LocalizationStatus::METRIC);
  EXPECT_EQ(message.source_name, "METRIC");
  EXPECT_EQ(message.inliers, 87U);
  EXPECT_EQ(message.reprojection, 0.75);
  EXPECT_NEAR(message.sigma_position, 0.03, 1e-12);
  EXPECT_NEAR(message.sigma_heading, std::sqrt(3e-5), 1e-12);
  EXPECT_NEAR(message.map_sigma_position, 0.2, 1e-12);
  EXPECT_NEAR(message.map_sigma_heading, 0.002, 1e-12);
}

TEST(MessageConversions, StatusOfAPlaceHasTheWholeSigmaAndNoneOfTheMap) {
  Estimate estimate = someEstimate();
  estimate.source = PoseSource::kPlace;
  estimate.images_since_metric = 4;
  const auto message = toStatus(estimate, header());
  EXPECT_EQ(message.source_name, "PLACE");
  EXPECT_EQ(message.inliers, 0U);
  EXPECT_NEAR(message.sigma_position, std::sqrt(2.5 + std::sqrt(2.5)), 1e-12);  // of the larger eigenvalue
  EXPECT_NEAR(message.sigma_heading, 0.2, 1e-12);
  EXPECT_EQ(message.map_sigma_position, 0.0);
  EXPECT_EQ(message.images_since_metric, 4U);
}

TEST(MessageConversions, OdometryIsTheMetricPoseWithoutAVelocity) {
  const auto pose = toMetricPose(metricEstimate(), header());
  ASSERT_TRUE(pose);
  const nav_msgs::Odometry odometry = toOdometry(*pose, "base_link");
  EXPECT_EQ(odometry.header.frame_id, pose->header.frame_id);
  EXPECT_EQ(odometry.child_frame_id, "base_link");
  EXPECT_EQ(odometry.pose.covariance, pose->pose.covariance);
  EXPECT_EQ(odometry.twist.covariance[0], 1e6);
  EXPECT_EQ(odometry.twist.covariance[35], 1e6);
}

TEST(MessageConversions, StatusSaysWhy) {
  Estimate estimate = someEstimate();
  estimate.evidence.probability = 0.5;
  estimate.threshold = 0.97;
  estimate.belief.off_map = 0.1;
  estimate.belief.rival = PlaceBelief::Place{9, {80.0, 3.0}, 0.25};
  estimate.unconfirmed = 4;
  estimate.why = {StateReason::kPlacesAlike, 0.25, {80.0, 3.0}};
  const auto message = toStatus(estimate, header());
  EXPECT_EQ(message.reason.value, Reason::PLACES_ALIKE);
  EXPECT_EQ(message.reason.name, "PLACES_ALIKE");
  EXPECT_EQ(message.reason.sentence, describe(estimate.why));
  EXPECT_EQ(message.reason.advice, textOf(StateReason::kPlacesAlike).advice);
  EXPECT_EQ(message.reason.x, 80.0);
  EXPECT_EQ(message.probability, 0.5);
  EXPECT_EQ(message.min_probability, 0.97);
  EXPECT_EQ(message.off_map, 0.1);
  EXPECT_EQ(message.rival_image, 9);
  EXPECT_EQ(message.rival_y, 3.0);
  EXPECT_EQ(message.rival_probability, 0.25);
  EXPECT_EQ(message.unconfirmed, 4U);
}

/// By the definition that travels with each bag.
TEST(MessageConversions, EachReasonIsAConstantOfTheMessage) {
  const std::string definition = ros::message_traits::definition<Reason>();
  std::size_t constants = 0;
  for (std::size_t i = 0; i < kReasons; ++i) {
    const std::string name = textOf(static_cast<StateReason>(i)).name;
    EXPECT_NE(definition.find("uint8 " + name + " = " + std::to_string(i) + " "), std::string::npos) << name;
  }
  for (std::size_t at = definition.find(" = "); at != std::string::npos; at = definition.find(" = ", at + 1)) {
    ++constants;
  }
  EXPECT_EQ(constants, kReasons);
}

TEST(MessageConversions, StatesAndKindsHaveTheNumbersOfTheMessages) {
  EXPECT_EQ(static_cast<int>(LocalizationState::kNoMap), LocalizationStatus::NO_MAP);
  EXPECT_EQ(static_cast<int>(LocalizationState::kInitializing), LocalizationStatus::INITIALIZING);
  EXPECT_EQ(static_cast<int>(LocalizationState::kTracking), LocalizationStatus::TRACKING);
  EXPECT_EQ(static_cast<int>(LocalizationState::kUncertain), LocalizationStatus::UNCERTAIN);
  EXPECT_EQ(static_cast<int>(LocalizationState::kRecovering), LocalizationStatus::RECOVERING);
  EXPECT_EQ(static_cast<int>(PoseSource::kNone), LocalizationStatus::NONE);
  EXPECT_EQ(static_cast<int>(PoseSource::kPlace), LocalizationStatus::PLACE);
  EXPECT_EQ(static_cast<int>(PoseSource::kMetric), LocalizationStatus::METRIC);
  EXPECT_EQ(static_cast<int>(FeatureKind::kLocal), LocalizationStatus::SIFT);
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

TEST(MessageConversions, WhatIsNotFiniteInAMetricPoseIsSeen) {
  EXPECT_TRUE(isFinite(metricEstimate()));
  for (const auto& number : numbersOf()) {
    for (const double bad : {kNan, kInfinity, -kInfinity}) {
      Estimate estimate = metricEstimate();
      number(*estimate.metric) = bad;
      EXPECT_FALSE(isFinite(estimate));
    }
  }
}

}  // namespace
}  // namespace visual_localization
