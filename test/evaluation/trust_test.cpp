#include <cmath>

#include <gtest/gtest.h>

#include "evaluation/metrics.h"

namespace visual_localization {
namespace {

StepRecord step(LocalizationState state, float error_m, bool off_map = false) {
  StepRecord record;
  record.state = state;
  record.error_m = error_m;
  record.off_map = off_map;
  return record;
}

TEST(Trust, CountsWhatIsClaimedAgainstWhatIsTrue) {
  Trust trust;
  for (int i = 0; i < 6; ++i) trust.add(step(LocalizationState::kTracking, 1.0F));
  for (int i = 0; i < 2; ++i) trust.add(step(LocalizationState::kTracking, 5.0F));
  trust.add(step(LocalizationState::kUncertain, 1.0F));
  trust.add(step(LocalizationState::kRecovering, 50.0F));
  trust.add(step(LocalizationState::kOffMap, 50.0F, true));
  trust.add(step(LocalizationState::kInitializing, 50.0F, true));
  EXPECT_DOUBLE_EQ(trust.trackingShare(), 8.0 / 12.0);
  EXPECT_DOUBLE_EQ(trust.wrongTracking(), 2.0 / 8.0);
  EXPECT_DOUBLE_EQ(trust.lostPrecision(), 3.0 / 4.0);
  EXPECT_DOUBLE_EQ(trust.lostRecall(), 3.0 / 5.0);
  EXPECT_DOUBLE_EQ(trust.offMapPrecision(), 1.0);
  EXPECT_DOUBLE_EQ(trust.offMapRecall(), 0.5);
}

TEST(Trust, LeavesOutWhatCannotBeJudged) {
  Trust trust;
  trust.add(step(LocalizationState::kTracking, std::nanf("")));
  trust.add(step(LocalizationState::kNoMap, 50.0F));  // a method without states
  EXPECT_TRUE(std::isnan(trust.trackingShare()));
  EXPECT_TRUE(std::isnan(trust.lostRecall()));
}

TEST(Trust, Adds) {
  Trust one;
  one.add(step(LocalizationState::kTracking, 1.0F));
  Trust other;
  other.add(step(LocalizationState::kTracking, 9.0F));
  other.add(step(LocalizationState::kOffMap, 9.0F));
  one += other;
  EXPECT_DOUBLE_EQ(one.wrongTracking(), 0.5);
  EXPECT_DOUBLE_EQ(one.lostRecall(), 0.5);
  EXPECT_DOUBLE_EQ(one.offMapPrecision(), 0.0);
}

}  // namespace
}  // namespace visual_localization
