// Known answers of the motion that leads from one verified pose to the next.

#include "localization/pose_predictor.h"

#include <optional>

#include <gtest/gtest.h>

#include "test/support/stamps.h"

namespace visual_localization {
namespace {

using test::ns;

/// Looks ahead along x, exactly known.
MetricPose poseAt(double x_m, double y_m) {
  MetricPose pose;
  pose.base = Eigen::Translation3d(x_m, y_m, 0.0);
  return pose;
}

class PosePredictorTest : public testing::Test {
 protected:
  /// The image at this time is verified there; whether the motion allows to be sure of it.
  bool add(double time_s, double x_m, double y_m = 0.0) {
    predictor_.startImage(ns(time_s));
    return predictor_.add(poseAt(x_m, y_m));
  }
  std::optional<PredictedPose> predictedAt(double time_s) {
    predictor_.startImage(ns(time_s));
    return predictor_.predicted();
  }
  /// Ten readings a second, a metre a second along x.
  void driveOn(double from_s, double to_s) {
    for (int k = 0; from_s + 0.1 * k <= to_s + 1e-9; ++k) {
      odometry_.add({ns(from_s + 0.1 * k), {from_s + 0.1 * k, 0.0}, 0.0});
    }
  }

  MetricConfig config_;
  OdometryTrack odometry_{OdometryConfig()};
  PosePredictor predictor_{config_};
};

TEST_F(PosePredictorTest, AVelocityHoldsForTheLongestGap) {
  add(0.0, 0.0);
  add(1.0, 1.0);
  const auto prediction = predictedAt(1.0 + PosePredictor::kMaxGap_s);
  ASSERT_TRUE(prediction);
  EXPECT_DOUBLE_EQ(prediction->position_m.x(), 1.0 + PosePredictor::kMaxGap_s);
  EXPECT_FALSE(predictedAt(1.001 + PosePredictor::kMaxGap_s));
}

TEST_F(PosePredictorTest, PosesFartherApartThanTheLongestGapTellNoVelocity) {
  add(0.0, 0.0);
  add(PosePredictor::kMaxGap_s + 0.5, 4.0);
  EXPECT_DOUBLE_EQ(predictedAt(PosePredictor::kMaxGap_s + 1.0)->position_m.x(), 4.0);
  predictor_.reset();
  add(0.0, 0.0);
  add(PosePredictor::kMaxGap_s, 4.0);
  EXPECT_GT(predictedAt(PosePredictor::kMaxGap_s + 1.0)->position_m.x(), 4.0);
}

TEST_F(PosePredictorTest, TwoPosesAtOneTimeTellNoVelocity) {
  add(1.0, 0.0);
  add(1.0, 0.5);
  EXPECT_DOUBLE_EQ(predictedAt(2.0)->position_m.x(), 0.5);
}

TEST_F(PosePredictorTest, AMovedThingIsAtMostFiveMetresBesideTheWay) {
  add(0.0, 0.0);
  add(1.0, 1.0);
  predictor_.startImage(ns(2.0));
  EXPECT_FALSE(predictor_.isBesidePrediction(poseAt(2.0, 1.4))) << "that is the way, which a robot may leave by half";
  EXPECT_TRUE(predictor_.isBesidePrediction(poseAt(2.0, 1.6)));
  EXPECT_TRUE(predictor_.isBesidePrediction(poseAt(2.0, 4.9)));
  EXPECT_FALSE(predictor_.isBesidePrediction(poseAt(2.0, 5.1))) << "so far away a robot was carried";
  predictor_.startImage(ns(3.0));
  EXPECT_FALSE(predictor_.isBesidePrediction(poseAt(3.0, 4.0))) << "in the next image as well";
}

TEST_F(PosePredictorTest, AfterALongGapAPoseFollowsWithinTheWayOfTheSpeed) {
  for (const double time_s : {0.0, 1.0, 2.0}) add(time_s, 0.1 * time_s);
  const double gap_s = PosePredictor::kMaxGap_s + 1.0;
  const double reach_m = config_.max_prediction_error_m + 1.5 * 0.1 * gap_s;
  predictor_.startImage(ns(2.0 + gap_s));
  EXPECT_TRUE(predictor_.follows(poseAt(0.2 + 0.99 * reach_m, 0.0)));
  EXPECT_TRUE(predictor_.follows(poseAt(0.2, -0.99 * reach_m)));
  EXPECT_FALSE(predictor_.follows(poseAt(0.2 + 1.01 * reach_m, 0.0)));
}

TEST_F(PosePredictorTest, OdometryLeadsAsFarAsItIsBelieved) {
  OdometryConfig config;
  config.max_distance_m = 4.0;
  for (int k = 0; k <= 5; ++k) odometry_.add({ns(0.5 * k), {1.0 * k, 0.0}, 0.0});
  predictor_.useOdometry(odometry_, config);
  add(0.0, 10.0);
  const auto prediction = predictedAt(2.0);
  ASSERT_TRUE(prediction);
  EXPECT_TRUE(prediction->by_odometry);
  EXPECT_DOUBLE_EQ(prediction->position_m.x(), 14.0);
  predictor_.startImage(ns(2.5));
  EXPECT_FALSE(predictor_.byOdometry());
}

/// A robot whose odometry leads to 3 m where its image is at 50 m.
class Contradicted : public PosePredictorTest {
 protected:
  Contradicted() {
    driveOn(0.0, 30.0);
    predictor_.useOdometry(odometry_, OdometryConfig());
    for (const double time_s : {0.0, 1.0, 2.0}) EXPECT_TRUE(add(time_s, time_s));
    EXPECT_FALSE(add(3.0, 50.0));
  }
};

TEST_F(Contradicted, APoseIsSureWhenTenMoreHaveFollowed) {
  for (int k = 1; k < 10; ++k) EXPECT_FALSE(add(3.0 + k, 50.0 + k)) << k;
  EXPECT_TRUE(add(13.0, 60.0));
}

TEST_F(Contradicted, NorIsOneThatTheMotionDoesNotLeadToCounted) {
  for (int k = 1; k < 10; ++k) EXPECT_FALSE(add(3.0 + k, 50.0 + k)) << k;
  EXPECT_FALSE(add(13.0, 90.0));
  EXPECT_TRUE(add(14.0, 91.0));
}

TEST_F(Contradicted, NobodyKnowsAfterSilenceAndALongGap) { EXPECT_TRUE(add(31.0 + PosePredictor::kMaxGap_s, 51.0)); }

TEST_F(Contradicted, AResetForgetsIt) {
  predictor_.reset();
  EXPECT_TRUE(add(4.0, 51.0));
}

}  // namespace
}  // namespace visual_localization
