#include <cmath>

#include <gtest/gtest.h>

#include "evaluation/metrics.h"

namespace visual_localization {
namespace {

StepRecord claim(LocalizationState state, bool right, bool wrong, float probability) {
  StepRecord step;
  step.error_m = 1.0F;
  step.state = state;
  step.right = right;
  step.wrong = wrong;
  step.probability = probability;
  return step;
}

TEST(Claims, CountsByTheAccuracyOfTheRound) {
  Claims claims;
  EXPECT_TRUE(std::isnan(claims.rightShare()));
  EXPECT_TRUE(std::isnan(claims.wrongClaims()));
  claims.add(claim(LocalizationState::kTracking, true, false, 0.99F));
  claims.add(claim(LocalizationState::kTracking, false, true, 0.98F));
  claims.add(claim(LocalizationState::kUncertain, false, true, 0.0F));
  claims.add(claim(LocalizationState::kTracking, false, false, 1.0F));  // neither right nor wrong
  claims.add(StepRecord());                                             // no true position
  EXPECT_EQ(claims.images, 4U);
  EXPECT_DOUBLE_EQ(claims.rightShare(), 0.25);
  EXPECT_DOUBLE_EQ(claims.wrongClaims(), 1.0 / 3.0);
  EXPECT_EQ(claims.bins.back().images, 3U);
  EXPECT_EQ(claims.bins.back().wrong, 1U);
  EXPECT_NEAR(claims.bins.back().probability, 2.97, 1e-6);
  EXPECT_EQ(claims.bins.front().images, 1U);
}

TEST(Claims, ABinHoldsItsBeginning) {
  for (std::size_t i = 0; i < Claims::kBins.size(); ++i) {
    Claims claims;
    claims.add(claim(LocalizationState::kTracking, true, false, static_cast<float>(Claims::kBins[i] + 1e-4)));
    EXPECT_EQ(claims.bins[i].images, 1U) << i;
  }
  Claims unknown;
  unknown.add(claim(LocalizationState::kTracking, true, false, std::nanf("")));
  for (const Claims::Bin& bin : unknown.bins) EXPECT_EQ(bin.images, 0U);
  EXPECT_EQ(unknown.images, 1U);
}

TEST(Claims, Adds) {
  Claims one;
  one.add(claim(LocalizationState::kTracking, true, false, 0.95F));
  Claims both;
  both.add(claim(LocalizationState::kUncertain, false, true, 0.95F));
  both += one;
  EXPECT_EQ(both.images, 2U);
  EXPECT_EQ(both.right, 1U);
  EXPECT_EQ(both.tracking, 1U);
  EXPECT_EQ(both.bins[9].images, 2U);
  EXPECT_EQ(both.bins[9].wrong, 1U);
}

}  // namespace
}  // namespace visual_localization
