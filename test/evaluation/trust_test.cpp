#include <cmath>

#include <gtest/gtest.h>

#include "evaluation/metrics.h"

namespace visual_localization {
namespace {

StepRecord claimOf(LocalizationState state, float error_m, bool off_map = false) {
  StepRecord record;
  record.state = state;
  record.error_m = error_m;
  record.off_map = off_map;
  return record;
}

TEST(Trust, CountsWhatIsClaimedAgainstWhatIsTrue) {
  Trust trust;
  for (int i = 0; i < 6; ++i) trust.add(claimOf(LocalizationState::kTracking, 1.0F));
  for (int i = 0; i < 2; ++i) trust.add(claimOf(LocalizationState::kTracking, 5.0F));
  trust.add(claimOf(LocalizationState::kUncertain, 1.0F));
  trust.add(claimOf(LocalizationState::kRecovering, 50.0F));
  trust.add(claimOf(LocalizationState::kOffMap, 50.0F, true));
  trust.add(claimOf(LocalizationState::kInitializing, 50.0F, true));
  EXPECT_DOUBLE_EQ(trust.trackingShare(), 8.0 / 12.0);
  EXPECT_DOUBLE_EQ(trust.wrongTracking(), 2.0 / 8.0);
  EXPECT_DOUBLE_EQ(trust.lostPrecision(), 3.0 / 4.0);
  EXPECT_DOUBLE_EQ(trust.lostRecall(), 3.0 / 5.0);
  EXPECT_DOUBLE_EQ(trust.offMapPrecision(), 1.0);
  EXPECT_DOUBLE_EQ(trust.offMapRecall(), 0.5);
}

TEST(Trust, LeavesOutWhatCannotBeJudged) {
  Trust trust;
  trust.add(claimOf(LocalizationState::kTracking, std::nanf("")));
  trust.add(claimOf(LocalizationState::kNoMap, 50.0F));  // a method without states
  EXPECT_TRUE(std::isnan(trust.trackingShare()));
  EXPECT_TRUE(std::isnan(trust.lostRecall()));
}

TEST(Trust, Adds) {
  Trust one;
  one.add(claimOf(LocalizationState::kTracking, 1.0F));
  Trust other;
  other.add(claimOf(LocalizationState::kTracking, 9.0F));
  other.add(claimOf(LocalizationState::kOffMap, 9.0F));
  one += other;
  EXPECT_DOUBLE_EQ(one.wrongTracking(), 0.5);
  EXPECT_DOUBLE_EQ(one.lostRecall(), 0.5);
  EXPECT_DOUBLE_EQ(one.offMapPrecision(), 0.0);
}

}  // namespace
}  // namespace visual_localization
