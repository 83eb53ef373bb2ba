#include "evaluation/run.h"

#include <gtest/gtest.h>

#include "test/evaluation/small_experiment.h"

namespace visual_localization::test {
namespace {

/// A swarm in the synthetic round, with changes to the method.
RunRecord runWith(const SyntheticRounds& rounds, double map_gap, double covered) {
  const ScoreTable table(*rounds.drive(), *rounds.map(), MatchConfig(), 1);
  MethodSpec method;
  method.tracker = "dpso";
  method.localizer.state.place_check = false;  // the rounds have no global features
  method.localizer.state.min_matches = 1;
  method.localizer.dpso.guided_start = false;
  method.map_gap = map_gap;
  method.covered = covered;
  const PartialMap partial = partOf(rounds.map(), map_gap);
  return run({partial, *rounds.drive(), table, true}, method, 0, false);
}

TEST(PartialMap, LeavesOutOnePieceAndRemembersWhoIsWho) {
  const SyntheticRounds rounds(100);
  const PartialMap whole = partOf(rounds.map(), 0.0);
  EXPECT_EQ(whole.map, rounds.map());
  EXPECT_TRUE(whole.images.empty());
  const PartialMap partial = partOf(rounds.map(), 0.2);
  ASSERT_EQ(partial.map->size(), 80U);
  ASSERT_EQ(partial.images.size(), 80U);
  EXPECT_EQ(partial.images[34], 34U);
  EXPECT_EQ(partial.images[35], 55U);
  EXPECT_EQ(partial.map->image(35).position_m, rounds.map()->image(55).position_m);
}

TEST(PartialMap, KeepsAnImageEverySoManyMetres) {
  const auto map = mapAt(street(30, 1.0));
  const PartialMap spaced = partOf(map, 0.0, 4.5);
  EXPECT_EQ(spaced.images, (std::vector<std::size_t>{0, 5, 10, 15, 20, 25}));
  EXPECT_EQ(spaced.map->position_m(2), map->position_m(10));
  EXPECT_EQ(partOf(map, 0.5, 4.5).images, (std::vector<std::size_t>{0, 5, 10, 26}));
  EXPECT_EQ(partOf(map, 0.0, 1000.0).images, (std::vector<std::size_t>{0}));
}

TEST(Run, OffTheMapIsWhereAllImagesAreFar) {
  const SyntheticRounds rounds(60);  // 75 m around
  const RunRecord whole = runWith(rounds, 0.0, 0.0);
  EXPECT_EQ(std::count_if(whole.steps.begin(), whole.steps.end(), [](const StepRecord& s) { return s.off_map; }), 0);
  const RunRecord record = runWith(rounds, 0.5, 0.0);
  ASSERT_EQ(record.steps.size(), 60U);
  EXPECT_FALSE(record.steps[10].off_map);
  EXPECT_TRUE(record.steps[35].off_map);
  EXPECT_FALSE(record.steps[55].off_map);
}

TEST(Run, WhatComesBeforeIsNotJudgedAndItsPlacesAreRightByTheirOwnAccuracy) {
  const SyntheticRounds rounds(60);
  const ScoreTable table(*rounds.drive(), *rounds.map(), MatchConfig(), 1);
  MethodSpec method;
  method.tracker = "exhaustive";
  const PartialMap whole = partOf(rounds.map(), 0.0);
  RunContext context{whole, *rounds.drive(), table, true};
  context.longest = 30;
  context.judge_from = 10;
  context.accuracy = {1e-6, 1e-3};
  const RunRecord record = run(context, method, 5, false);
  ASSERT_EQ(record.steps.size(), 30U);
  EXPECT_TRUE(std::isnan(record.steps[9].error_m));
  ASSERT_FALSE(std::isnan(record.steps[10].error_m));
  EXPECT_EQ(record.steps_to_localise, 1U) << "found before it is judged";
  for (const StepRecord& step : record.steps) {
    if (std::isnan(step.error_m)) continue;
    EXPECT_EQ(step.right, static_cast<double>(step.error_m) <= 1e-6);
    EXPECT_EQ(step.wrong, static_cast<double>(step.error_m) > 1e-3);
  }
}

TEST(Run, ACoveredCameraRecognisesNothing) {
  const SyntheticRounds rounds(60);
  const RunRecord record = runWith(rounds, 0.0, 0.2);
  EXPECT_EQ(record.steps[29].state, LocalizationState::kTracking);
  for (std::size_t i = 32; i < 42; ++i) EXPECT_NE(record.steps[i].state, LocalizationState::kTracking) << i;
  for (std::size_t i = 32; i < 42; ++i) EXPECT_NE(record.steps[i].state, LocalizationState::kOffMap) << i;
}

}  // namespace
}  // namespace visual_localization::test
