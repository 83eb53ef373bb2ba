#include "visual_localization/localizer/state_assessor.h"

#include <gtest/gtest.h>

namespace visual_localization {
namespace {

TrackerEstimate seen(double similarity, std::size_t matches, double x = 0.0) {
  TrackerEstimate estimate;
  estimate.best = {similarity, similarity, matches, similarity >= 0.05};
  estimate.position_m = {x, 0.0};
  return estimate;
}

const TrackerEstimate kGood = seen(0.3, 30);
const TrackerEstimate kBad = seen(0.01, 1);

LocalizationState afterGood(StateAssessor& assessor, int images) {
  LocalizationState state = LocalizationState::kNoMap;
  for (int i = 0; i < images; ++i) state = assessor.assess(kGood, FeatureKind::kSift, false);
  return state;
}

TEST(StateAssessor, EnoughGoodImagesConfirmAPosition) {
  StateAssessor assessor{StateConfig()};
  EXPECT_EQ(afterGood(assessor, 3), LocalizationState::kInitializing);
  EXPECT_EQ(afterGood(assessor, 1), LocalizationState::kTracking);
}

TEST(StateAssessor, OneBadImageIsForgivenTwoAreNot) {
  StateAssessor assessor{StateConfig()};
  afterGood(assessor, 10);
  EXPECT_EQ(assessor.assess(kBad, FeatureKind::kSift, false), LocalizationState::kTracking);
  EXPECT_EQ(assessor.assess(kBad, FeatureKind::kSift, false), LocalizationState::kUncertain);
  EXPECT_EQ(assessor.assess(kBad, FeatureKind::kSift, true), LocalizationState::kRecovering);
}

TEST(StateAssessor, AfterALossThePositionMustBeConfirmedAgain) {
  StateAssessor assessor{StateConfig()};
  afterGood(assessor, 10);
  for (int i = 0; i < 5; ++i) assessor.assess(kBad, FeatureKind::kSift, true);
  EXPECT_EQ(afterGood(assessor, 3), LocalizationState::kUncertain);
  EXPECT_EQ(afterGood(assessor, 1), LocalizationState::kTracking);
}

TEST(StateAssessor, AJumpVoidsEarlierConfirmations) {
  StateAssessor assessor{StateConfig()};
  afterGood(assessor, 10);
  EXPECT_EQ(assessor.assess(seen(0.3, 30, 60.0), FeatureKind::kSift, false), LocalizationState::kUncertain);
}

TEST(StateAssessor, AShareOfFewFeaturesIsNoEvidence) {
  StateAssessor assessor{StateConfig()};
  for (int i = 0; i < 20; ++i)
    EXPECT_EQ(assessor.assess(seen(0.5, 2), FeatureKind::kSift, false), LocalizationState::kInitializing);
}

/// After ten images of this similarity by global features, which count no matches.
LocalizationState afterGlobal(double similarity, double best_distance_m = 0.0) {
  StateAssessor assessor{StateConfig()};
  TrackerEstimate estimate = seen(similarity, 0);
  estimate.best_distance_m = best_distance_m;
  LocalizationState state = LocalizationState::kNoMap;
  for (int i = 0; i < 10; ++i) state = assessor.assess(estimate, FeatureKind::kGlobal, false);
  return state;
}

TEST(StateAssessor, GlobalFeaturesConfirmByTheirOwnThreshold) {
  EXPECT_EQ(afterGlobal(0.65), LocalizationState::kTracking);
  EXPECT_EQ(afterGlobal(0.649), LocalizationState::kInitializing) << "more than enough for SIFT";
  EXPECT_EQ(afterGlobal(0.9, 5.01), LocalizationState::kInitializing) << "elsewhere";
}

TEST(StateAssessor, BothKindsOfEvidenceAddUp) {
  StateAssessor assessor{StateConfig()};
  afterGood(assessor, 2);
  EXPECT_EQ(assessor.assess(seen(0.7, 0), FeatureKind::kGlobal, false), LocalizationState::kInitializing);
  EXPECT_EQ(assessor.assess(seen(0.7, 0), FeatureKind::kGlobal, false), LocalizationState::kTracking);
  for (int i = 0; i < 2; ++i) assessor.assess(seen(0.3, 0), FeatureKind::kGlobal, false);
  EXPECT_EQ(assessor.assess(kBad, FeatureKind::kSift, false), LocalizationState::kUncertain);
}

TEST(StateAssessor, AMatchElsewhereDoesNotConfirmThisPlace) {
  StateAssessor assessor{StateConfig()};
  TrackerEstimate estimate = seen(0.3, 30);
  estimate.best_distance_m = 20.0;
  for (int i = 0; i < 10; ++i)
    EXPECT_EQ(assessor.assess(estimate, FeatureKind::kSift, false), LocalizationState::kInitializing);
}

TEST(StateAssessor, ResetForgets) {
  StateAssessor assessor{StateConfig()};
  afterGood(assessor, 10);
  assessor.reset();
  EXPECT_EQ(assessor.assess(kGood, FeatureKind::kSift, false), LocalizationState::kInitializing);
}

TEST(StateAssessor, NamesOfTheStates) {
  EXPECT_EQ(toString(LocalizationState::kNoMap), "NO_MAP");
  EXPECT_EQ(toString(LocalizationState::kRecovering), "RECOVERING");
}

}  // namespace
}  // namespace visual_localization
