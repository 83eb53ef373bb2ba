// The rules of the localizer, by images that are known by their scores alone.

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "test/localization/localizer_fixture.h"
#include "test/support/swarm_config.h"

namespace visual_localization {
namespace {

using test::kSecond_ns;
using test::twoSessions;

using LocalizerRules = test::LocalizerTest;

TEST_F(LocalizerRules, ARepeatedImageGetsTheSameAnswerWithItsOwnStampAndReport) {
  const Estimate first = settle();
  EXPECT_EQ(first.stamp_ns, 40 * kSecond_ns);
  EXPECT_EQ(first.repeats, 0U);
  image_->repeated = true;
  image_->features = 77;
  const int compared = image_->compared;
  const Estimate second = see(50.0, 0.1);
  EXPECT_EQ(image_->compared, compared) << "nothing is computed";
  EXPECT_EQ(second.stamp_ns, static_cast<std::int64_t>(40.1 * 1e9));
  EXPECT_EQ(second.repeats, 1U);
  EXPECT_EQ(second.image.features_kept, 77U);
  EXPECT_EQ(second.pose.position_m, first.pose.position_m);
  EXPECT_EQ(second.state, first.state);
  EXPECT_FALSE(second.frozen);
  image_->repeated = false;
  EXPECT_EQ(see(20.0).repeats, 0U);
}

TEST_F(LocalizerRules, TheCameraIsFrozenAfterSoManyImagesInSoLongATime) {
  LocalizerConfig config = test::swarmConfig();
  config.state.frozen_images = 4;
  config.state.frozen_time_s = 2.0;
  make(config);
  settle();
  image_->repeated = true;
  for (int i = 1; i <= 3; ++i) EXPECT_FALSE(see(20.0, 1.0).frozen) << i << ": long enough, but too few";
  const Estimate frozen = see(20.0, 1.0);
  EXPECT_TRUE(frozen.frozen);
  EXPECT_EQ(frozen.state, LocalizationState::kUncertain);

  make(config);
  settle();
  image_->repeated = true;
  for (int i = 1; i <= 7; ++i) EXPECT_FALSE(see(20.0, 0.25).frozen) << i << ": many, but in less than two seconds";
  EXPECT_TRUE(see(20.0, 0.25).frozen) << "exactly two seconds";
}

TEST_F(LocalizerRules, ADriverThatSendsItsLastImageOnAndOnIsStuck) {
  LocalizerConfig config = test::swarmConfig();
  config.state.frozen_images = 4;
  config.state.frozen_time_s = 2.0;
  make(config);
  settle();
  image_->repeated = true;
  see(20.0, 0.1);  // one with another stamp, then always the same
  for (int i = 1; i <= 29; ++i) EXPECT_FALSE(see(20.0, 0.0).frozen) << i;
  EXPECT_TRUE(see(20.0, 0.0).frozen);
}

TEST_F(LocalizerRules, OneRepetitionMayFreezeTheCamera) {
  LocalizerConfig config = test::swarmConfig();
  config.state.frozen_images = 1;
  config.state.frozen_time_s = 0.0;
  make(config);
  settle();
  image_->repeated = true;
  const int compared = image_->compared;
  EXPECT_TRUE(see(20.0, 0.1).frozen);
  EXPECT_EQ(image_->compared, compared) << "with another stamp it is the same image";
}

TEST_F(LocalizerRules, WithoutFreezingOnlyTheSameStampIsTheSameImage) {
  LocalizerConfig config = test::swarmConfig();
  config.state.frozen_images = 0;
  make(config);
  settle();
  image_->repeated = true;
  int compared = image_->compared;
  see(20.0, 0.0);
  EXPECT_EQ(image_->compared, compared);
  see(20.0, 0.1);
  EXPECT_GT(image_->compared, compared) << "an image like any other";
  for (int i = 0; i < 50; ++i) EXPECT_FALSE(see(20.0, 0.0).frozen);
}

TEST_F(LocalizerRules, WhatShowsNothingIsBlind) {
  const auto min_features = static_cast<std::size_t>(config_.state.min_features);
  image_->features = min_features;
  EXPECT_FALSE(see(20.0).evidence.blind);
  image_->features = min_features - 1;
  EXPECT_TRUE(see(20.0).evidence.blind);
  LocalizerConfig config = test::swarmConfig();
  config.features = "global";
  make(config);
  image_->features = 0;
  EXPECT_FALSE(see(20.0).evidence.blind) << "global features need none";
  image_->best = 0.0;
  EXPECT_TRUE(see(20.0).evidence.blind);
}

TEST_F(LocalizerRules, OnlyWhatIsRecognisedIsAPlace) {
  EXPECT_EQ(settle().source, PoseSource::kPlace);
  image_->best = 0.04;
  const Estimate estimate = see(20.0);
  EXPECT_EQ(estimate.source, PoseSource::kNone);
  EXPECT_FALSE(estimate.tracked.best.recognised);
  LocalizerConfig lenient = config_;
  lenient.similarity.sift_recognised = 0.01;
  localizer_->configure(lenient);
  EXPECT_EQ(see(20.0).source, PoseSource::kPlace) << "the image learnt the new threshold";
}

TEST_F(LocalizerRules, ATrackedPlaceHasTheCovarianceOfItsMode) {
  constexpr double kFloor_m2 = LocalizerConfig::kMinPositionStd_m * LocalizerConfig::kMinPositionStd_m;
  const Estimate tracked = settle();
  EXPECT_LT((tracked.pose.covariance_m2 - tracked.tracked.mode_covariance_m2 - kFloor_m2 * Eigen::Matrix2d::Identity())
                .cwiseAbs()
                .maxCoeff(),
            1e-12);
  image_->best = 0.0;
  Estimate lost;
  for (int i = 0; i < 5; ++i) lost = see(20.0);
  ASSERT_NE(lost.state, LocalizationState::kTracking);
  EXPECT_LT((lost.pose.covariance_m2 - lost.tracked.cloud_covariance_m2 - kFloor_m2 * Eigen::Matrix2d::Identity())
                .cwiseAbs()
                .maxCoeff(),
            1e-12);
}

TEST_F(LocalizerRules, APlaceIsInterpolatedBetweenTheTrainingImagesOrTheBestParticle) {
  Estimate estimate;
  for (int i = 0; i < 40; ++i) estimate = see(20.3);
  EXPECT_NEAR(estimate.pose.position_m.x(), 20.3, 1e-6) << "by the size of what it shows";
  EXPECT_EQ(estimate.pose.position_m.y(), 0.0);
  for (const auto& [name, value] : {std::make_pair("estimate", "image"), std::make_pair("features", "global")}) {
    LocalizerConfig config = test::swarmConfig();
    (std::string(name) == "estimate" ? config.estimate : config.features) = value;
    make(config);
    for (int i = 0; i < 40; ++i) estimate = see(20.3);
    EXPECT_EQ(estimate.pose.position_m, estimate.tracked.position_m) << name;
  }
}

TEST_F(LocalizerRules, AMatchFarFromTheParticlesIsNotWhereTheRobotIs) {
  LocalizerConfig config = test::swarmConfig();
  config.state.max_distance_m = 0.1;
  config.state.place_check = false;
  config.dpso.particles = 10;  // few are near
  make(config);
  int far = 0;
  int near = 0;
  for (int i = 0; i < 100; ++i) {
    const Estimate estimate = see(20.3);
    if (!estimate.tracked.best.recognised) continue;
    const bool is_far = estimate.tracked.best_distance_m > 0.1;
    EXPECT_EQ(estimate.pose.position_m == estimate.tracked.position_m, is_far) << "otherwise interpolated";
    ++(is_far ? far : near);
  }
  EXPECT_GT(far, 3);
  EXPECT_GT(near, 3);
}

TEST_F(LocalizerRules, TheSecondWitnessIsAskedOnlyWhereTheFirstIsNotSure) {
  settle();
  image_->best = config_.state.sure_similarity + 0.05;
  Estimate estimate;
  for (int i = 0; i < 5; ++i) estimate = see(20.0);
  EXPECT_EQ(estimate.swept, 0U);
  EXPECT_EQ(estimate.evidence.place_ratio, 1.0);
  image_->best = 0.9 * config_.state.sure_similarity;
  EXPECT_GT(see(20.0).swept, 0U);
  LocalizerConfig without = config_;
  without.state.place_check = false;
  localizer_->configure(without);
  EXPECT_EQ(see(20.0).swept, 0U);
}

TEST_F(LocalizerRules, GlobalFeaturesAloneAreNeverSure) {
  LocalizerConfig config = test::swarmConfig();
  config.features = "global";
  make(config);
  image_->best = 0.95;
  Estimate estimate;
  for (int i = 0; i < 40; ++i) estimate = see(20.0);
  ASSERT_GT(estimate.tracked.best.similarity, config.state.sure_similarity);
  ASSERT_LT(estimate.tracked.best_distance_m, config.state.max_distance_m);
  EXPECT_GT(estimate.swept, 0U);
}

TEST_F(LocalizerRules, SaysWhichSessionItComparesWithAndLearnsABetterOne) {
  make(test::swarmConfig(), twoSessions());
  image_->best = 0.2;
  image_->best_of_others = 0.2;
  Estimate estimate = see(20.0);
  EXPECT_EQ(estimate.session, "first") << "at this time of day";
  for (int i = 0; i < 60; ++i) estimate = see(20.0);
  EXPECT_EQ(estimate.session, "first");
  image_->best_of_others = 0.6;
  for (int i = 0; i < 60; ++i) estimate = see(20.0);
  EXPECT_EQ(estimate.session, "second");
  LocalizerConfig without = config_;
  without.choose_session = false;
  localizer_->configure(without);
  EXPECT_EQ(see(20.0).session, "");
}

TEST_F(LocalizerRules, AnImageThatIsNotRecognisedTeachesNothingAboutSessions) {
  constexpr int kTrialEvery = 4;
  make(test::swarmConfig(), twoSessions());
  image_->best_of_others = 0.2;
  for (int i = 1; i <= 80; ++i) {
    image_->best = i % kTrialEvery == 0 ? 0.02 : 0.2;
    const Estimate estimate = see(20.0);
    EXPECT_EQ(estimate.tracked.best.recognised, i % kTrialEvery != 0) << i;
    EXPECT_EQ(estimate.session, "first") << i;
  }
}

TEST_F(LocalizerRules, WhereNothingIsSeenTheSessionsTakeTurns) {
  make(test::swarmConfig(), twoSessions());
  for (int i = 0; i < 30; ++i) see(20.0);
  EXPECT_EQ(see(20.0).session, "first") << "something is seen";
  image_->best = image_->best_of_others = 0.0;
  bool second = false;
  for (int i = 0; i < 8; ++i) second = see(20.0).session == "second" || second;
  EXPECT_TRUE(second);
}

/// Only odometry moves it.
LocalizerConfig ofAStillSwarm() {
  LocalizerConfig config = test::swarmConfig();
  config.dpso.quantum_share = 0.0;
  config.dpso.quantum_share_max = 0.0;
  config.dpso.inertia = 0.0;
  config.dpso.phi0 = 0.0;
  config.dpso.phi2 = 0.0;
  config.dpso.phi2_min = 0.0;
  config.dpso.recovery = "none";
  return config;
}

TEST_F(LocalizerRules, OdometryMovesTheParticlesByTheWaySinceTheLastImage) {
  LocalizerConfig config = ofAStillSwarm();
  config.odometry.share = 1.0;
  make(config);
  for (int k = 0; k <= 100; ++k) localizer_->addOdometry({k * kSecond_ns / 10, {0.2 * k, 0.0}, 0.0});  // 2 m/s
  localizer_->relocalize(around({20.0, 0.0}, 1.0));
  image_->best = 0.0;
  see(20.0);
  double x_m = localizer_->particles().front().position_m.x();
  for (int i = 0; i < 5; ++i) {
    see(20.0);
    EXPECT_NEAR(localizer_->particles().front().position_m.x(), x_m + 2.0, 1e-6) << i;
    x_m = localizer_->particles().front().position_m.x();
  }
}

TEST_F(LocalizerRules, AnotherShareOfOdometryHoldsFromTheNextImageOn) {
  LocalizerConfig config = ofAStillSwarm();
  config.odometry.share = 0.0;
  make(config);
  for (int k = 0; k <= 100; ++k) localizer_->addOdometry({k * kSecond_ns / 10, {0.2 * k, 0.0}, 0.0});  // 2 m/s
  localizer_->relocalize(around({20.0, 0.0}, 1.0));
  image_->best = 0.0;
  see(20.0);
  const double before_m = localizer_->particles().front().position_m.x();
  see(20.0);
  EXPECT_NEAR(localizer_->particles().front().position_m.x(), before_m, 1e-6);
  config.odometry.share = 1.0;
  localizer_->configure(config);
  see(20.0);
  EXPECT_NEAR(localizer_->particles().front().position_m.x(), before_m + 2.0, 1e-6);
}

TEST_F(LocalizerRules, SaysHowFarTheLastImagesAreFromASteadyMotion) {
  make(test::swarmConfig());
  MotionConsistency expected(StateAssessor::kMotionLength);
  double largest_m = 0.0;
  for (const double x_m : {20.0, 21.0, 23.0, 22.0, 24.0, 21.0, 23.0, 22.0}) {
    const Estimate estimate = see(x_m);
    expected.add(estimate.stamp_ns, estimate.tracked.position_m);
    EXPECT_NEAR(estimate.motion_residual_m, expected.residual_m(), 1e-9);
    largest_m = std::max(largest_m, estimate.motion_residual_m);
  }
  EXPECT_GT(largest_m, 0.5);
}

TEST_F(LocalizerRules, APlaceHasTheHeadingOfItsTrainingImages) {
  std::vector<Eigen::Vector2d> north;
  for (int i = 0; i < 60; ++i) north.emplace_back(0.0, 1.0 * i);
  make({}, test::mapAt(north));
  Estimate estimate;
  for (int i = 0; i < 40; ++i) {
    image_->position_m = {0.0, 20.0};
    estimate = localizer_->process((i + 1) * kSecond_ns, cv::Mat());
  }
  EXPECT_NEAR(estimate.pose.yaw_rad, std::acos(0.0), 1e-6);
}

TEST_F(LocalizerRules, TheReportIsThatOfTheImage) {
  image_->features = 42;
  const Estimate estimate = see(20.0);
  EXPECT_EQ(estimate.image.features_kept, 42U);
  EXPECT_EQ(estimate.image.match_ms, 0.0) << "no landmarks, no time for them";
  EXPECT_EQ(estimate.images_since_metric, 0U);
}

TEST_F(LocalizerRules, APlaceIsOnTheEarthWhereItIsInTheMap) {
  const Estimate estimate = settle();
  const GeodeticPoint expected = localizer_->map().frame().toGeodetic(estimate.pose.position_m);
  EXPECT_EQ(estimate.pose.geodetic.latitude_deg, expected.latitude_deg);
  EXPECT_EQ(estimate.pose.geodetic.longitude_deg, expected.longitude_deg);
}

TEST_F(LocalizerRules, BeginsWithTheSessionOfTheHour) {
  make(test::swarmConfig(), twoSessions());
  EXPECT_EQ(see(20.0, 1010.0).session, "second");
}

}  // namespace
}  // namespace visual_localization
