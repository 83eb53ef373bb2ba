// TRACKING by the probability around the estimate.
#include <cstddef>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "test/localization/localizer_fixture.h"
#include "visual_localization/localization/localizer.h"

namespace visual_localization {
namespace {

/// The fixture's street, driven from one end at a metre an image.
class TrackingByProbability : public test::LocalizerTest, public testing::WithParamInterface<const char*> {
 protected:
  TrackingByProbability() {
    LocalizerConfig config;
    config.tracker = GetParam();
    make(config);
  }
};

INSTANTIATE_TEST_SUITE_P(Trackers, TrackingByProbability,
                         testing::Values("bayes", "dpso", "dpso_multi", "pf_gaussian", "pf_linear"),
                         [](const auto& tracker) { return std::string(tracker.param); });

TEST_P(TrackingByProbability, ARobotThatIsRecognisedIsTracked) {
  Estimate estimate;
  for (int x_m = 0; x_m < 40; ++x_m) estimate = see(x_m);
  EXPECT_EQ(estimate.state, LocalizationState::kTracking);
  EXPECT_GE(estimate.evidence.probability.value_or(0.0), config_.state.min_probability);
  EXPECT_NEAR(estimate.pose.position_m.x(), 39.0, 2.0);
}

TEST_P(TrackingByProbability, WhatMatchesNothingIsNeverTracked) {
  image_->best = 0.0;
  for (int x_m = 0; x_m < 40; ++x_m) EXPECT_NE(see(x_m).state, LocalizationState::kTracking) << x_m;
}

TEST_P(TrackingByProbability, AnImageThatShowsNothingIsNotTracked) {
  for (int x_m = 0; x_m < 40; ++x_m) see(x_m);
  image_->features = 0;
  image_->best = 0.0;
  EXPECT_EQ(see(40.0).state, LocalizationState::kUncertain);
  image_->features = 100;
  image_->best = 0.5;
  for (int x_m = 41; x_m < 44; ++x_m) see(x_m);
  EXPECT_EQ(see(44.0).state, LocalizationState::kTracking);
}

TEST_P(TrackingByProbability, AnImageThatComesAgainLateIsNotTracked) {
  for (int x_m = 0; x_m < 40; ++x_m) see(x_m);
  image_->repeated = true;
  EXPECT_EQ(see(40.0, 0.1).state, LocalizationState::kTracking) << "a stream that repeats images to reach its rate";
  const Estimate late = see(40.0, 0.9);
  EXPECT_EQ(late.state, LocalizationState::kUncertain);
  EXPECT_FALSE(late.frozen) << "twice";
}

TEST_P(TrackingByProbability, AnImageFromBeforeTheLastOneIsNotTracked) {
  for (int x_m = 0; x_m < 40; ++x_m) see(x_m);
  EXPECT_EQ(see(39.0, -20.0).state, LocalizationState::kUncertain);
  EXPECT_EQ(see(40.0).state, LocalizationState::kTracking);
}

TEST_P(TrackingByProbability, RelocalizingForgetsTheProbability) {
  for (int x_m = 0; x_m < 40; ++x_m) see(x_m);
  localizer_->relocalize();
  image_->best = 0.0;
  EXPECT_NE(see(40.0).state, LocalizationState::kTracking);
}

TEST_P(TrackingByProbability, CostsNoFurtherComparison) {
  LocalizerConfig without = config_;
  without.state.witness = "similarity";
  without.state.place_check = false;
  std::vector<std::size_t> with_it;
  for (int x_m = 0; x_m < 20; ++x_m) with_it.push_back(see(x_m).comparisons);
  make(without);
  for (int x_m = 0; x_m < 20; ++x_m) EXPECT_EQ(see(x_m).comparisons, with_it[static_cast<std::size_t>(x_m)]);
}

TEST_P(TrackingByProbability, ByGlobalFeaturesThresholdsDecide) {
  LocalizerConfig config = config_;
  config.features = "global";
  make(config);
  EXPECT_FALSE(see(20.0).evidence.probability);
}

}  // namespace
}  // namespace visual_localization
