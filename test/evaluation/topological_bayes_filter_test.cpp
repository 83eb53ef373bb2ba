#include <cmath>

#include <gtest/gtest.h>

#include "evaluation/place_recogniser.h"
#include "test/evaluation/place_rows.h"

namespace visual_localization {
namespace {

/// Moves that are certain, so that answers can be worked out by hand.
TopologicalBayesConfig byHand() {
  TopologicalBayesConfig config;
  config.min_step = 0;
  config.max_step = 1;
  config.reset = 0.0;
  config.delta = 3.0;
  config.window = 1;
  return config;
}

TEST(TopologicalBayesFilter, KnownPosterior) {
  TopologicalBayesFilter filter(byHand(), true);
  // Quantiles of the differences 0.5, 0.5, 0.5, 0.9 (linear): 0.5 and 0.87, so lambda = ln 3 / 0.37.
  const double weak = std::exp(-std::log(3.0) / 0.37 * 0.4);
  const Recognition first = filter.update({0.5, 0.5, 0.5, 0.1});
  EXPECT_EQ(first.training_image, 0u);
  EXPECT_NEAR(first.confidence, 1.0 / (3.0 + weak), 1e-12);
  // Half of every state moves on by one. The dark image says nothing more, so states 1 and 2 keep what they have.
  const Recognition second = filter.update({0.0, 0.0, 0.0, 0.0});
  EXPECT_EQ(second.training_image, 1u);
  EXPECT_NEAR(second.confidence, 1.0 / (3.0 + weak), 1e-12);
}

TEST(TopologicalBayesFilter, OpenRoutePilesUpAtItsEnd) {
  TopologicalBayesFilter filter(byHand(), false);
  filter.update({0.5, 0.5});  // no contrast, no evidence: one half each
  EXPECT_NEAR(filter.update({0.0, 0.0}).confidence, 0.75, 1e-12);
  const Recognition later = filter.update({0.0, 0.0});
  EXPECT_EQ(later.training_image, 1u);
  EXPECT_NEAR(later.confidence, 0.875, 1e-12);
}

TEST(TopologicalBayesFilter, ResetProbabilitySpreadsEvenly) {
  TopologicalBayesConfig config = byHand();
  config.max_step = 0;
  config.reset = 0.4;
  config.delta = 1e6;
  TopologicalBayesFilter filter(config, true);
  EXPECT_NEAR(filter.update({1.0, 0.0, 0.0, 0.0}).confidence, 1.0, 1e-5);
  EXPECT_NEAR(filter.update({0.0, 0.0, 0.0, 0.0}).confidence, 0.6 + 0.4 / 4.0, 1e-5);
}

TEST(TopologicalBayesFilter, DarkImagesBeforeTheFirstGoodOneDoNotSpoilTheCalibration) {
  TopologicalBayesConfig config = byHand();
  config.min_step = config.max_step = 0;
  TopologicalBayesFilter awake(config, true);
  TopologicalBayesFilter asleep(config, true);
  asleep.update({0.0, 0.0, 0.0});
  asleep.update({0.3, 0.3, 0.3});
  const std::vector<double> row = {0.1, 0.5, 0.2};
  EXPECT_NEAR(asleep.update(row).confidence, awake.update(row).confidence, 1e-12);
}

TEST(TopologicalBayesFilter, CalibratesByASinglePeakThatQuantilesMiss) {
  std::vector<double> row(1000, 0.0);
  row[700] = 0.5;
  TopologicalBayesConfig config = byHand();
  TopologicalBayesFilter filter(config, true);
  const Recognition answer = filter.update(row);
  EXPECT_EQ(answer.training_image, 700u);
  EXPECT_NEAR(answer.confidence, 3.0 / (3.0 + 999.0), 1e-12);
}

TEST(TopologicalBayesFilter, OutvotesAMisleadingImage) {
  TopologicalBayesFilter filter({}, false);
  test::drive(filter, 20, 15, 100, false);
  std::vector<double> misleading = test::rowAt(35, 100, false);
  misleading[80] = 0.7;
  EXPECT_EQ(filter.update(misleading).training_image, 35u);
}

TEST(TopologicalBayesFilter, FollowsAClosedRouteOverItsEndWithoutDoubt) {
  TopologicalBayesConfig config;
  config.reset = 0.0;
  TopologicalBayesFilter filter(config, true);
  test::drive(filter, 20, 20, 40, true);
  for (std::size_t step = 0; step < 10; ++step) {
    const Recognition answer = filter.update(test::rowAt(step, 40, true));
    EXPECT_EQ(answer.training_image, step);
    EXPECT_GT(answer.confidence, 0.95);
  }
}

TEST(TopologicalBayesFilter, KidnappingIsSurvivedByTheResetOnly) {
  TopologicalBayesConfig without_reset;
  without_reset.reset = 0.0;
  TopologicalBayesFilter survives({}, true);
  TopologicalBayesFilter stays(without_reset, true);
  for (TopologicalBayesFilter* filter : {&survives, &stays}) test::drive(*filter, 0, 40, 100, true);
  const Recognition found = test::drive(survives, 90, 8, 100, true);
  const Recognition lost = test::drive(stays, 90, 8, 100, true);
  EXPECT_EQ(found.training_image, 97u);
  EXPECT_GT(found.confidence, 0.9);
  EXPECT_LT(lost.training_image, 70u);
}

TEST(TopologicalBayesFilter, LikelihoodsTooSmallForADoubleAreNotLost) {
  TopologicalBayesConfig config = byHand();
  config.delta = 1e6;
  TopologicalBayesFilter filter(config, false);
  // Calibrated on a whisper of contrast: exp(-lambda d) is 0 for any difference worth mentioning.
  EXPECT_EQ(filter.update({0.5, 0.50001, 0.5, 0.5, 0.5}).training_image, 1u);
  const Recognition answer = filter.update({0.2, 0.1, 0.2, 0.1, 0.8});
  EXPECT_EQ(answer.training_image, 4u);
  EXPECT_NEAR(answer.confidence, 1.0, 1e-9);
}

TEST(TopologicalBayesFilter, AnswersWithTheMostProbableStateOfTheLikeliestPlace) {
  TopologicalBayesConfig config = byHand();
  config.window = 3;
  TopologicalBayesFilter filter(config, false);
  const Recognition answer = filter.update({0.0, 0.0, 0.3, 0.35, 0.3, 0.0, 0.0, 0.0, 0.4, 0.0});
  EXPECT_EQ(answer.training_image, 3u);  // not 8, alone with the highest similarity
}

}  // namespace
}  // namespace visual_localization
