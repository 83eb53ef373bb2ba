
#include <gtest/gtest.h>

#include "visual_localization/localization/state.h"
#include "visual_localization/parameters/parameters.h"

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

/// What one image says, and whether the tracker takes itself to be lost.
struct Said {
  Evidence evidence;
  bool recovering = false;
};

Said sift() { return {{FeatureKind::kLocal}}; }
Said global() { return {{FeatureKind::kGlobal}}; }
Said lost() { return {{FeatureKind::kLocal}, true}; }
Said placeRatio(double ratio) { return {{FeatureKind::kLocal, ratio}}; }
Said blind() { return {{FeatureKind::kLocal, 1.0, true}}; }

LocalizationState assess(StateAssessor& assessor, TrackerEstimate estimate, const Said& said) {
  estimate.recovering = said.recovering;
  return assessor.update(0, estimate, said.evidence);
}

LocalizationState afterGood(StateAssessor& assessor, int images) {
  LocalizationState state = LocalizationState::kNoMap;
  for (int i = 0; i < images; ++i) state = assess(assessor, kGood, sift());
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
  EXPECT_EQ(assess(assessor, kBad, sift()), LocalizationState::kTracking);
  EXPECT_EQ(assess(assessor, kBad, sift()), LocalizationState::kUncertain);
  EXPECT_EQ(assess(assessor, kBad, lost()), LocalizationState::kRecovering);
}

TEST(StateAssessor, AfterALossThePositionMustBeConfirmedAgain) {
  StateAssessor assessor{StateConfig()};
  afterGood(assessor, 10);
  for (int i = 0; i < 5; ++i) assess(assessor, kBad, lost());
  EXPECT_EQ(afterGood(assessor, 3), LocalizationState::kUncertain);
  EXPECT_EQ(afterGood(assessor, 1), LocalizationState::kTracking);
}

TEST(StateAssessor, AJumpVoidsEarlierConfirmations) {
  StateAssessor assessor{StateConfig()};
  afterGood(assessor, 10);
  EXPECT_EQ(assess(assessor, seen(0.3, 30, 60.0), sift()), LocalizationState::kUncertain);
}

TEST(StateAssessor, AShareOfFewFeaturesIsNoEvidence) {
  StateAssessor assessor{StateConfig()};
  for (int i = 0; i < 9; ++i) EXPECT_EQ(assess(assessor, seen(0.5, 2), sift()), LocalizationState::kInitializing);
}

TEST(StateAssessor, WhatLooksMuchLargerOrSmallerIsSeenFromElsewhere) {
  const auto stateAt = [](double scale) {
    StateAssessor assessor{StateConfig()};
    TrackerEstimate estimate = kGood;
    estimate.best.scale = scale;
    LocalizationState state = LocalizationState::kNoMap;
    for (int i = 0; i < 9; ++i) state = assess(assessor, estimate, sift());
    return state;
  };
  for (const double scale : {0.84, 1.0, 1.19}) EXPECT_EQ(stateAt(scale), LocalizationState::kTracking) << scale;
  for (const double scale : {0.5, 0.83, 1.21, 3.0})
    EXPECT_EQ(stateAt(scale), LocalizationState::kInitializing) << scale;
}

TEST(StateAssessor, AMatchedPlaceIsNotOffTheMap) {
  StateAssessor assessor{StateConfig()};
  // Every second image matches: too few for TRACKING, but a robot off the map would see nothing it knows.
  for (int i = 0; i < 18; ++i) {
    EXPECT_EQ(assess(assessor, i % 2 == 0 ? kGood : kBad, sift()), LocalizationState::kInitializing) << i;
  }
  EXPECT_EQ(assess(assessor, kBad, sift()), LocalizationState::kOffMap) << "ten of them matched nothing";
}

/// After nine images of this similarity by global features, which count no matches.
LocalizationState afterGlobal(double similarity, double best_distance_m = 0.0) {
  StateAssessor assessor{StateConfig()};
  TrackerEstimate estimate = seen(similarity, 0);
  estimate.best_distance_m = best_distance_m;
  LocalizationState state = LocalizationState::kNoMap;
  for (int i = 0; i < 9; ++i) state = assess(assessor, estimate, global());
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
  EXPECT_EQ(assess(assessor, seen(0.7, 0), global()), LocalizationState::kInitializing);
  EXPECT_EQ(assess(assessor, seen(0.7, 0), global()), LocalizationState::kTracking);
  for (int i = 0; i < 2; ++i) assess(assessor, seen(0.3, 0), global());
  EXPECT_EQ(assess(assessor, kBad, sift()), LocalizationState::kUncertain);
}

TEST(StateAssessor, AMatchElsewhereDoesNotConfirmThisPlace) {
  StateAssessor assessor{StateConfig()};
  TrackerEstimate estimate = seen(0.3, 30);
  estimate.best_distance_m = 20.0;
  for (int i = 0; i < 9; ++i) EXPECT_EQ(assess(assessor, estimate, sift()), LocalizationState::kInitializing);
}

TEST(StateAssessor, ResetForgets) {
  StateAssessor assessor{StateConfig()};
  afterGood(assessor, 10);
  assessor.reset();
  EXPECT_EQ(assess(assessor, kGood, sift()), LocalizationState::kInitializing);
}

TEST(StateAssessor, AnImageThatLooksMoreLikeAnotherPlaceCastsDoubt) {
  StateAssessor assessor{StateConfig()};
  afterGood(assessor, 10);
  EXPECT_EQ(assess(assessor, kGood, placeRatio(0.94)), LocalizationState::kTracking) << "mean of five: 0.988";
  EXPECT_FALSE(assessor.isDoubtful());
  EXPECT_EQ(assess(assessor, kGood, placeRatio(0.94)), LocalizationState::kUncertain);
  EXPECT_TRUE(assessor.isDoubtful());
  EXPECT_EQ(afterGood(assessor, 4), LocalizationState::kTracking) << "one of the two is out of the window";
}

TEST(StateAssessor, AnEstimateThatJumpsToAndFroIsNotTrusted) {
  StateAssessor assessor{StateConfig()};
  afterGood(assessor, 10);
  LocalizationState state = LocalizationState::kNoMap;
  for (int i = 0; i < 6; ++i) state = assess(assessor, seen(0.3, 30, i % 2 == 0 ? 8.0 : 0.0), sift());
  EXPECT_EQ(state, LocalizationState::kUncertain);
  EXPECT_GT(assessor.motionResidual_m(), 2.5);
}

TEST(StateAssessor, AFastRobotIsNotARestlessOne) {
  StateAssessor assessor{StateConfig()};
  LocalizationState state = LocalizationState::kNoMap;
  for (int i = 0; i < 10; ++i) state = assess(assessor, seen(0.3, 30, 9.5 * i), sift());
  EXPECT_EQ(state, LocalizationState::kTracking);
}

TEST(StateAssessor, LongWithoutConfirmationIsOffTheMap) {
  StateAssessor assessor{StateConfig()};
  afterGood(assessor, 10);
  assess(assessor, kBad, lost());  // forgiven
  for (int i = 0; i < 9; ++i) EXPECT_EQ(assess(assessor, kBad, lost()), LocalizationState::kRecovering);
  EXPECT_EQ(assess(assessor, kBad, lost()), LocalizationState::kOffMap);
  EXPECT_EQ(assess(assessor, kBad, sift()), LocalizationState::kOffMap);
  EXPECT_EQ(afterGood(assessor, 4), LocalizationState::kTracking) << "back on the map";
}

TEST(StateAssessor, ACoveredCameraIsNotOffTheMap) {
  StateAssessor assessor{StateConfig()};
  afterGood(assessor, 10);
  LocalizationState state = LocalizationState::kNoMap;
  for (int i = 0; i < 30; ++i) state = assess(assessor, kBad, blind());
  EXPECT_EQ(state, LocalizationState::kUncertain);
}

TEST(StateAssessor, InDoubtThePositionMustBeConfirmedAnew) {
  StateAssessor assessor{StateConfig()};
  EXPECT_EQ(assessor.doubt(false), LocalizationState::kInitializing);
  afterGood(assessor, 10);
  EXPECT_EQ(assessor.doubt(false), LocalizationState::kUncertain);
  EXPECT_EQ(assess(assessor, kBad, sift()), LocalizationState::kUncertain);
  EXPECT_EQ(afterGood(assessor, 3), LocalizationState::kUncertain);
  EXPECT_EQ(afterGood(assessor, 1), LocalizationState::kTracking);
}

TEST(StateAssessor, OtherThresholdsKeepWhatTheLastImagesSaid) {
  StateAssessor assessor{StateConfig()};
  afterGood(assessor, 10);
  StateConfig stricter;
  stricter.window = 2;
  stricter.images_to_confirm = 2;
  stricter.min_similarity = 0.9;
  assessor.configure(stricter);
  EXPECT_EQ(assess(assessor, kGood, sift()), LocalizationState::kUncertain);
  stricter.min_similarity = StateConfig().min_similarity;
  assessor.configure(stricter);
  assess(assessor, kGood, sift());
  EXPECT_EQ(assess(assessor, kGood, sift()), LocalizationState::kTracking);
}

TEST(StateAssessor, NamesOfTheStates) {
  EXPECT_EQ(toString(LocalizationState::kOffMap), "OFF_MAP");
  EXPECT_EQ(toString(LocalizationState::kNoMap), "NO_MAP");
  EXPECT_EQ(toString(LocalizationState::kRecovering), "RECOVERING");
}

/// State after four images like this one.
LocalizationState afterFour(const TrackerEstimate& estimate, const Said& said) {
  StateAssessor assessor{StateConfig()};
  LocalizationState state = LocalizationState::kNoMap;
  for (int i = 0; i < 4; ++i) state = assess(assessor, estimate, said);
  return state;
}

TEST(StateAssessor, TheThresholdsThemselvesConfirm) {
  const StateConfig config;
  const auto tracks = [](const TrackerEstimate& estimate, const Said& said) {
    return afterFour(estimate, said) == LocalizationState::kTracking;
  };
  TrackerEstimate estimate = seen(config.min_similarity, static_cast<std::size_t>(config.min_matches));
  EXPECT_TRUE(tracks(estimate, sift()));
  estimate.best.scale = config.max_scale;
  EXPECT_TRUE(tracks(estimate, sift()));
  estimate.best.scale = 1.0 / config.max_scale;
  EXPECT_TRUE(tracks(estimate, sift()));
  estimate.best.scale = 0.999 / config.max_scale;
  EXPECT_FALSE(tracks(estimate, sift()));
  estimate.best.scale = 1.001 * config.max_scale;
  EXPECT_FALSE(tracks(estimate, sift()));
  estimate = kGood;
  estimate.best_distance_m = config.max_distance_m;
  EXPECT_TRUE(tracks(estimate, sift()));
  estimate.best_distance_m = 1.001 * config.max_distance_m;
  EXPECT_FALSE(tracks(estimate, sift()));
  EXPECT_FALSE(tracks(seen(0.999 * config.min_similarity, 100), sift()));
  EXPECT_FALSE(tracks(seen(0.9, static_cast<std::size_t>(config.min_matches) - 1), sift()));
  EXPECT_TRUE(tracks(seen(config.min_global_similarity, 0), global()));
  EXPECT_FALSE(tracks(seen(0.999 * config.min_global_similarity, 0), global()));
  EXPECT_TRUE(tracks(kGood, placeRatio(config.min_place_ratio)));
  EXPECT_FALSE(tracks(kGood, placeRatio(0.999 * config.min_place_ratio)));
}

TEST(StateAssessor, AStepAsLongAsIsAllowedKeepsTheConfirmations) {
  StateConfig config;
  config.max_motion_residual_m = 1e6;  // it alone decides
  for (const double step_m : {config.max_step_m, 1.001 * config.max_step_m}) {
    StateAssessor assessor{config};
    afterGood(assessor, 6);
    const bool tracks = assess(assessor, seen(0.3, 30, step_m), sift()) == LocalizationState::kTracking;
    EXPECT_EQ(tracks, step_m == config.max_step_m);
  }
}

// In other light landmarks fail where the place is certain.
TEST(StateAssessor, WithoutAVerifiedPoseTheProbabilityDecides) {
  StateAssessor assessor{StateConfig()};
  Said unverified = sift();
  unverified.evidence.verified = false;
  unverified.evidence.probability = 0.99;
  EXPECT_EQ(assess(assessor, kGood, unverified), LocalizationState::kTracking);
  unverified.evidence.probability = 0.9;
  EXPECT_EQ(assess(assessor, kGood, unverified), LocalizationState::kUncertain);
}

TEST(StateAssessor, AVerifiedPoseDecidesAlone) {
  StateAssessor assessor{StateConfig()};
  Said verified = sift();
  verified.evidence.verified = true;
  EXPECT_EQ(assess(assessor, kBad, verified), LocalizationState::kTracking) << "whatever the match says";
  Said refuted = sift();
  refuted.evidence.verified = false;
  for (int i = 0; i < 6; ++i) EXPECT_EQ(assess(assessor, kGood, refuted), LocalizationState::kUncertain);
  refuted.recovering = true;
  EXPECT_EQ(assess(assessor, kGood, refuted), LocalizationState::kRecovering);
  verified.recovering = true;
  EXPECT_EQ(assess(assessor, kBad, verified), LocalizationState::kTracking);
}

// A map that says of itself that it may be 30 m off.
TEST(StateAssessor, APositionThatIsHardlyKnownIsNotClaimed) {
  StateAssessor assessor{StateConfig()};
  Said vague = sift();
  vague.evidence.verified = true;
  vague.evidence.probability = 0.999;
  vague.evidence.vague = true;
  EXPECT_NE(assess(assessor, kGood, vague), LocalizationState::kTracking);
  vague.evidence.vague = false;
  EXPECT_EQ(assess(assessor, kGood, vague), LocalizationState::kTracking);
}

TEST(StateAssessor, OffTheMapAfterExactlySoManyImages) {
  StateConfig config;
  config.off_map_images = 7;
  StateAssessor assessor{config};
  for (int i = 1; i <= 6; ++i) EXPECT_EQ(assess(assessor, kBad, sift()), LocalizationState::kInitializing) << i;
  EXPECT_EQ(assess(assessor, kBad, lost()), LocalizationState::kOffMap);
  for (int i = 1; i <= 30; ++i) assess(assessor, kBad, lost());
  Said verified = sift();
  verified.evidence.verified = true;
  EXPECT_EQ(assess(assessor, kGood, verified), LocalizationState::kTracking);
  for (int i = 1; i <= 6; ++i) EXPECT_NE(assess(assessor, kBad, sift()), LocalizationState::kOffMap) << i;
  EXPECT_EQ(assess(assessor, kBad, sift()), LocalizationState::kOffMap) << "counted anew";
}

TEST(StateAssessor, OnlyMatchedLocalFeaturesSayThatThisIsTheMap) {
  StateConfig config;
  config.off_map_images = 7;
  for (const bool local : {true, false}) {
    StateAssessor assessor{config};
    TrackerEstimate estimate = seen(0.9, 50);
    LocalizationState state = LocalizationState::kNoMap;
    for (int i = 0; i < 10; ++i) {
      Said said = local ? sift() : global();
      said.evidence.place_ratio = 0.0;  // another place looks more alike: nothing is certain
      state = assess(assessor, estimate, said);
    }
    EXPECT_EQ(state == LocalizationState::kOffMap, !local);
  }
}

TEST(StateAssessor, AJumpForgetsTheDoubtsOfTheOtherPlace) {
  StateConfig config;
  config.max_motion_residual_m = 1e6;
  StateAssessor assessor{config};
  for (int i = 0; i < 10; ++i) assess(assessor, kGood, placeRatio(0.0));
  EXPECT_TRUE(assessor.isDoubtful());
  assess(assessor, seen(0.3, 30, 100.0), placeRatio(1.0));
  EXPECT_FALSE(assessor.isDoubtful());
}

}  // namespace
}  // namespace visual_localization
