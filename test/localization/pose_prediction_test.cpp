// Where the motion since the last verified pose leads, and what a pose says about it.

#include <algorithm>
#include <cmath>
#include <cstdint>

#include <gtest/gtest.h>

#include "base/numbers.h"
#include "test/localization/pose_verifier_fixture.h"
#include "visual_localization/localization/metric_pose.h"

namespace visual_localization {
namespace {

using test::kSecond_ns;
using test::PoseVerifierTest;

using PosePrediction = PoseVerifierTest;

TEST_F(PosePrediction, PredictsWithAGrowingCovariance) {
  ASSERT_TRUE(verifyNear(0.0, 10));
  const auto pose = verifyNear(1.0, 11);
  ASSERT_TRUE(pose);
  verify(2.0, LocalFeatures(), {});
  const auto soon = verifier_.predictor().predicted();
  verify(4.0, LocalFeatures(), {});
  const auto later = verifier_.predictor().predicted();
  ASSERT_TRUE(soon && later);
  EXPECT_GT(soon->covariance_m2(0, 0), pose->covariance(0, 0) + pose->map_covariance(0, 0));
  EXPECT_GT(later->covariance_m2(0, 0), soon->covariance_m2(0, 0));
  EXPECT_GT(later->yaw_variance_rad2, soon->yaw_variance_rad2);
}

/// The covariance of position and heading that a pose has of itself and of the map.
MetricPose::Covariance allOf(const MetricPose& pose) { return pose.covariance + pose.map_covariance; }

TEST_F(PosePrediction, TheVelocityLeadsStraightOnAndIsTheLessSureTheFarther) {
  const auto first = verifyNear(0.0, 10);
  const auto second = verifyNear(0.5, 11);
  ASSERT_TRUE(first && second);
  verify(2.0, LocalFeatures(), {});
  const auto prediction = verifier_.predictor().predicted();
  ASSERT_TRUE(prediction);
  const Eigen::Vector2d step_m = (second->base.translation() - first->base.translation()).head<2>();
  const Eigen::Vector2d way_m = 3.0 * step_m;  // in three times the time
  EXPECT_LT((prediction->position_m - second->base.translation().head<2>() - way_m).norm(), 1e-9);
  EXPECT_NEAR(prediction->yaw_rad, yawOf(second->base), 1e-12);
  EXPECT_NEAR(prediction->sigma_m, 0.5 * way_m.norm(), 1e-9);
  EXPECT_FALSE(prediction->by_odometry);
  const MetricPose::Covariance start = allOf(*second);
  const Eigen::Matrix2d expected_m2 =
      start.topLeftCorner<2, 2>() + std::pow(prediction->sigma_m, 2) * Eigen::Matrix2d::Identity();
  EXPECT_LT((prediction->covariance_m2 - expected_m2).cwiseAbs().maxCoeff(), 1e-9);
  EXPECT_NEAR(prediction->yaw_variance_rad2, start(5, 5) + std::pow(0.1 * way_m.norm(), 2), 1e-9);
}

TEST_F(PosePrediction, OdometryLeadsWhereItWentAndAWrongHeadingLeadsAside) {
  OdometryConfig config;
  config.distance_sigma = 0.1;
  config.turn_sigma_rad_m = 0.05;
  OdometryTrack track(config);
  verifier_.predictor().useOdometry(track, config);
  const auto pose = verifyNear(0.0, 10);
  ASSERT_TRUE(pose);
  // 4 m ahead in a straight line, then 3 m to the left: 7 m of way, turned to the left.
  for (int i = 0; i <= 20; ++i) {
    const double ahead_m = 4.0 * std::min(1.0, i / 10.0);
    const double left_m = 3.0 * std::max(0.0, i / 10.0 - 1.0);
    track.add({i * kSecond_ns / 10, {ahead_m, left_m}, i > 10 ? 0.5 : 0.0});
  }
  verify(2.0, LocalFeatures(), {});
  const auto prediction = verifier_.predictor().predicted();
  ASSERT_TRUE(prediction);
  EXPECT_TRUE(prediction->by_odometry);
  const Eigen::Vector2d way_m = Eigen::Rotation2Dd(yawOf(pose->base)) * Eigen::Vector2d(4.0, 3.0);
  EXPECT_LT((prediction->position_m - pose->base.translation().head<2>() - way_m).norm(), 1e-6);
  EXPECT_NEAR(std::remainder(prediction->yaw_rad - yawOf(pose->base) - 0.5, 2.0 * kPi), 0.0, 1e-9);
  EXPECT_NEAR(prediction->sigma_m, 0.1 * 7.0, 1e-6);
  const double turn_rad = 0.05 * 7.0;
  const MetricPose::Covariance start = allOf(*pose);
  EXPECT_NEAR(prediction->yaw_variance_rad2, start(5, 5) + turn_rad * turn_rad, 1e-6);
  const Eigen::Vector2d aside_m(-way_m.y(), way_m.x());
  const Eigen::Matrix2d expected_m2 = start.topLeftCorner<2, 2>() + 0.49 * Eigen::Matrix2d::Identity() +
                                      (start(5, 5) + 0.25 * turn_rad * turn_rad) * aside_m * aside_m.transpose();
  EXPECT_LT((prediction->covariance_m2 - expected_m2).cwiseAbs().maxCoeff(), 1e-5);
}

TEST_F(PosePrediction, OdometryThatTurnsOnLeadsToAHeadingWithinHalfATurn) {
  const OdometryConfig config;
  OdometryTrack track(config);
  verifier_.predictor().useOdometry(track, config);
  const auto pose = verifyNear(0.0, 22);
  ASSERT_TRUE(pose);
  const double yaw_rad = yawOf(pose->base);
  ASSERT_GT(std::abs(yaw_rad), 0.5);
  const double turn_rad = yaw_rad > 0.0 ? 2.8 : -2.8;
  for (int i = 0; i <= 10; ++i) track.add({i * kSecond_ns / 10, {0.0, 0.0}, 0.1 * i * turn_rad});
  verify(1.0, LocalFeatures(), {});
  const auto prediction = verifier_.predictor().predicted();
  ASSERT_TRUE(prediction && prediction->by_odometry);
  EXPECT_NEAR(prediction->yaw_rad, yaw_rad + turn_rad - std::copysign(2.0 * kPi, turn_rad), 1e-9);
}

// A robot that stands, whose wheels slip once.
TEST_F(PosePrediction, OdometryIsBelievedAgainAfterTenPosesThatItAgreesWith) {
  const OdometryConfig config;
  OdometryTrack track(config);
  verifier_.predictor().useOdometry(track, config);
  double x_m = 0.0;
  track.add({0, {x_m, 0.0}, 0.0});
  ASSERT_TRUE(verifyNear(0.0, 10));
  /// Whether odometry leads to the image of this second, whose pose is solved then.
  const auto leads = [&](std::int64_t second, double slip_m) {
    for (int k = 1; k <= 5; ++k) {
      track.add({(second - 1) * kSecond_ns + k * kSecond_ns / 5, {x_m += 0.2 * slip_m, 0.0}, 0.0});
    }
    const LocalFeatures nothing;
    verifier_.startImage(second * kSecond_ns, nothing, street_.camera());
    const auto prediction = verifier_.predictor().predicted();
    EXPECT_TRUE(verifyNear(static_cast<double>(second), 10)) << second;
    return prediction && prediction->by_odometry;
  };
  for (int second = 1; second <= 3; ++second) EXPECT_TRUE(leads(second, 0.0)) << second;
  EXPECT_TRUE(leads(4, 4.0)) << "nobody knows yet that this is wrong";
  for (int second = 5; second <= 14; ++second) EXPECT_FALSE(leads(second, 0.0)) << second;
  EXPECT_TRUE(leads(15, 0.0));
}

/// A robot that stands and whose wheels say that it moved and turned in the second before an image: whether odometry is
/// still believed afterwards.
class OdometryAgreement : public PoseVerifierTest {
 protected:
  bool stillBelieved(double moved_m, double turned_rad) {
    OdometryTrack track(config_);
    verifier_.predictor().useOdometry(track, config_);
    verifier_.reset();
    const LocalFeatures seen = street_.seenFrom(street_.trueNear(10, kBeside_m));
    begin_s_ += 1000.0;
    const auto at = [this](double time_s) { return static_cast<std::int64_t>((begin_s_ + time_s) * kSecond_ns); };
    const auto look = [&](double time_s) { return verify(begin_s_ + time_s, seen, {9, 10, 11}); };
    for (int k = -150; k <= 0; ++k) track.add({at(0.1 * k), {0.0, 0.0}, 0.0});
    for (int second = -12; second < 0; ++second) look(second);  // so that it is believed again
    const auto first = look(0.0);
    EXPECT_TRUE(first);
    for (int k = 1; k <= 15; ++k) {  // up to half a second after the image
      const double share = std::min(1.0, 0.1 * k);
      track.add({at(0.1 * k), {share * moved_m, 0.0}, share * turned_rad});
    }
    sigma_m_ = first ? largerSigma(Eigen::Matrix2d(first->covariance.topLeftCorner<2, 2>())) : 0.0;
    EXPECT_TRUE(look(1.0));
    verifier_.startImage(at(1.2), seen, street_.camera());
    const auto prediction = verifier_.predictor().predicted();
    return prediction && prediction->by_odometry;
  }

  OdometryConfig config_;
  double begin_s_ = 0.0;
  double sigma_m_ = 0.0;  ///< of where odometry leads
};

TEST_F(OdometryAgreement, WithinThirtyCentimetresAndThreeSigmas) {
  config_.distance_sigma = 0.0001;
  EXPECT_TRUE(stillBelieved(0.0, 0.0));
  const double most_m = 0.3 + 3.0 * sigma_m_;
  ASSERT_GT(3.0 * sigma_m_, 0.02) << "otherwise 3 sigmas look like 6";
  EXPECT_TRUE(stillBelieved(most_m - 0.02, 0.0));
  EXPECT_FALSE(stillBelieved(most_m + 0.02, 0.0));
  EXPECT_TRUE(stillBelieved(-most_m + 0.02, 0.0));
  EXPECT_FALSE(stillBelieved(-most_m - 0.02, 0.0));
}

TEST_F(OdometryAgreement, WithinThreeTenthsOfARadian) {
  for (const double direction : {1.0, -1.0}) {
    EXPECT_TRUE(stillBelieved(0.0, direction * 0.28)) << direction;
    EXPECT_FALSE(stillBelieved(0.0, direction * 0.32)) << direction;
  }
}

TEST_F(PosePrediction, OdometryLeadsNoFartherThanIsBelieved) {
  for (const double max_distance_m : {7.5, 6.5}) {
    OdometryConfig config;
    config.max_distance_m = max_distance_m;
    OdometryTrack track(config);
    verifier_.predictor().useOdometry(track, config);
    verifier_.reset();
    ASSERT_TRUE(verifyNear(0.0, 10));
    for (int i = 0; i <= 10; ++i) track.add({i * kSecond_ns / 10, {0.7 * i, 0.0}, 0.0});
    verify(1.0, LocalFeatures(), {});
    const auto prediction = verifier_.predictor().predicted();
    ASSERT_TRUE(prediction) << "otherwise by the velocity";
    EXPECT_EQ(prediction->by_odometry, max_distance_m > 7.0);
  }
}

TEST_F(PosePrediction, NothingIsPredictedForTimesBeforeThePose) {
  ASSERT_TRUE(verifyNear(100.0, 10));
  EXPECT_TRUE(verifier_.predictor().predicted()) << "of the same moment";
  verify(99.0, LocalFeatures(), {});
  EXPECT_FALSE(verifier_.predictor().predicted());
}

// Four metres a second predict four metres on, and that to 2 m of its own beside the metre that is allowed.
TEST_F(PosePrediction, AFastRobotMayBeFartherFromItsPrediction) {
  ASSERT_TRUE(verifyNear(0.0, 6));
  ASSERT_TRUE(verifyNear(1.0, 10));
  const auto few = street_.fewSeenFrom(street_.trueNear(12, kBeside_m), 14);
  EXPECT_TRUE(verify(2.0, few, {12})) << "2 m short of the prediction";
}

}  // namespace
}  // namespace visual_localization
