#include "visual_localization/localization/reason.h"

#include <fstream>
#include <iterator>
#include <set>
#include <string>

#include <gtest/gtest.h>

#include "test/localization/localizer_fixture.h"
#include "visual_localization/localization/estimate.h"

namespace visual_localization {
namespace {

std::string pageOfReasons() {
  std::ifstream file(TEST_DATA_DIR "/../../doc/when_it_does_not_localise.md");
  return {std::istreambuf_iterator<char>(file), {}};
}

TEST(Reasons, EachHasWordsOfItsOwnAndThePageHasTheSame) {
  const std::string page = pageOfReasons();
  std::set<std::string> names;
  std::set<std::string> sentences;
  for (std::size_t i = 0; i < kReasons; ++i) {
    const ReasonText& text = textOf(static_cast<StateReason>(i));
    names.insert(text.name);
    sentences.insert(text.sentence);
    const std::string row = "| `" + std::string(text.name) + "` | " + text.sentence + " | " + text.advice + " |";
    EXPECT_NE(page.find(row), std::string::npos) << row;
  }
  EXPECT_EQ(names.size(), kReasons);
  EXPECT_EQ(sentences.size(), kReasons);
  EXPECT_THROW(textOf(static_cast<StateReason>(kReasons)), std::out_of_range);
}

TEST(Reasons, SentenceHasItsPositionAndItsFigure) {
  const std::string sentence = textOf(StateReason::kMapEnds).sentence;
  EXPECT_EQ(describe({StateReason::kMapEnds, 0.914, {12.0, -3.456}}),
            sentence + ", at x = 12 m, y = -3.46 m (probability off the map: 0.91)");
  EXPECT_EQ(describe({StateReason::kMapEnds}), sentence);
  EXPECT_EQ(describe({StateReason::kNoMap}), textOf(StateReason::kNoMap).sentence);
}

/// An image that shows enough, compared by local features, in a map that says this of it.
Estimate lostEstimate(double probability, double off_map, double followed) {
  Estimate estimate;
  estimate.state = LocalizationState::kUncertain;
  estimate.evidence.probability = probability;
  estimate.belief.off_map = off_map;
  estimate.belief.followed = followed;
  estimate.tracked.best.matches = 40;
  estimate.tracked.best.recognised = true;
  return estimate;
}

StateReason reasonOf(const Estimate& estimate, const Circumstances& circumstances = {}) {
  return explain(estimate, {}, circumstances).reason;
}

TEST(Explain, TellsOffTheMapFromOtherLight) {
  EXPECT_EQ(reasonOf(lostEstimate(0.05, 0.9, 0.1)), StateReason::kNotMapped);
  EXPECT_EQ(reasonOf(lostEstimate(0.05, 0.9, 0.8)), StateReason::kWeakMatches);
  Circumstances passed;
  passed.left_at = PlaceBelief::Place{7, {31.0, 2.0}, 0.8};
  const Why why = explain(lostEstimate(0.05, 0.9, 0.1), {}, passed);
  EXPECT_EQ(why.reason, StateReason::kMapEnds);
  EXPECT_EQ(why.position_m.x(), 31.0);
  EXPECT_EQ(why.figure, 0.9);
}

TEST(Explain, NothingIsOffTheMapBeforeAnythingIsKnown) {
  Estimate first = lostEstimate(0.05, 0.5, 0.1);
  first.state = LocalizationState::kInitializing;
  EXPECT_EQ(reasonOf(first), StateReason::kNotSureYet);
  Circumstances later;
  later.unconfirmed = 3;
  EXPECT_EQ(reasonOf(first, later), StateReason::kNotMapped);
}

TEST(Explain, NamesTheOtherPlaceThatLooksAlike) {
  Estimate alike = lostEstimate(0.5, 0.01, 0.5);
  alike.belief.rival = PlaceBelief::Place{9, {80.0, 0.0}, 0.45};
  const Why why = explain(alike, {}, {});
  EXPECT_EQ(why.reason, StateReason::kPlacesAlike);
  EXPECT_EQ(why.position_m.x(), 80.0);
  EXPECT_EQ(why.figure, 0.45);
  alike.belief.rival->probability = 0.1;
  EXPECT_EQ(reasonOf(alike), StateReason::kNotSureYet);
}

TEST(Explain, TheFirstCauseThatHoldsCounts) {
  Estimate estimate = lostEstimate(0.5, 0.01, 0.5);
  estimate.evidence.unverified = true;
  EXPECT_EQ(reasonOf(estimate), StateReason::kNoLandmarks);
  Circumstances circumstances;
  circumstances.turned = true;
  EXPECT_EQ(reasonOf(estimate, circumstances), StateReason::kOtherDirection);
  estimate.other_lens = true;
  EXPECT_EQ(reasonOf(estimate, circumstances), StateReason::kOtherLens);
  estimate.image.statistics.stretch = 1.33;
  EXPECT_EQ(reasonOf(estimate, circumstances), StateReason::kOtherShape);
  estimate.evidence.blind = true;
  EXPECT_EQ(reasonOf(estimate, circumstances), StateReason::kFewFeatures);
  circumstances.late = true;
  EXPECT_EQ(reasonOf(estimate, circumstances), StateReason::kImageLate);
  estimate.state = LocalizationState::kTracking;
  EXPECT_EQ(reasonOf(estimate, circumstances), StateReason::kAlongTheWay);
  estimate.metric.emplace().inliers = 54;
  estimate.evidence.verified = true;
  EXPECT_EQ(explain(estimate, {}, circumstances).figure, 54.0);
  EXPECT_EQ(reasonOf(estimate, circumstances), StateReason::kLandmarks);
}

TEST(Explain, APositionThatIsHardlyKnownSaysSo) {
  Estimate vague = lostEstimate(0.999, 0.0, 0.999);
  vague.evidence.vague = true;
  vague.pose.covariance_m2 = 900.0 * Eigen::Matrix2d::Identity();
  const Why why = explain(vague, {}, {});
  EXPECT_EQ(why.reason, StateReason::kVague);
  EXPECT_EQ(why.figure, 30.0);
}

TEST(Explain, ByThresholdsEachTestHasItsReason) {
  Estimate estimate = lostEstimate(0.0, 0.0, 0.0);
  estimate.evidence.probability.reset();
  estimate.tracked.best.similarity = 0.5;
  EXPECT_EQ(reasonOf(estimate), StateReason::kNotSureYet);
  estimate.motion_residual_m = 4.0;
  EXPECT_EQ(reasonOf(estimate), StateReason::kUnsteady);
  estimate.tracked.best.similarity = 0.01;
  EXPECT_EQ(reasonOf(estimate), StateReason::kWeakMatches);
  Circumstances doubtful;
  doubtful.doubtful = true;
  EXPECT_EQ(reasonOf(estimate, doubtful), StateReason::kPlacesAlike);
  estimate.state = LocalizationState::kTracking;
  EXPECT_EQ(reasonOf(estimate), StateReason::kSimilarImages);
}

/// The fixture's street, driven from one end at a metre an image.
class ReasonOfADrive : public test::LocalizerTest {
 protected:
  ReasonOfADrive() { make(LocalizerConfig()); }
  Estimate drive(int from_m, int to_m) {
    Estimate estimate;
    for (int x_m = from_m; x_m < to_m; ++x_m) estimate = see(x_m);
    return estimate;
  }
};

TEST_F(ReasonOfADrive, IsConfirmedAlongTheWay) {
  const Estimate estimate = drive(0, 40);
  EXPECT_EQ(estimate.why.reason, StateReason::kAlongTheWay);
  EXPECT_EQ(estimate.threshold, config_.state.min_probability);
  EXPECT_EQ(estimate.why.figure, estimate.evidence.probability);
  EXPECT_LT(estimate.belief.off_map, 0.05);
  EXPECT_EQ(estimate.unconfirmed, 0);
  ASSERT_TRUE(estimate.belief.rival);
  EXPECT_LT(estimate.belief.rival->probability, 0.05);
  EXPECT_GT(std::abs(estimate.belief.rival->position_m.x() - 39.0), 5.0);
}

TEST_F(ReasonOfADrive, IsTheImageThatShowsNothingOrComesLate) {
  drive(0, 40);
  image_->features = 3;
  const Estimate blind = see(40.0);
  EXPECT_EQ(blind.why.reason, StateReason::kFewFeatures);
  EXPECT_EQ(blind.why.figure, 3.0);
  image_->features = 100;
  EXPECT_EQ(see(39.0, -20.0).why.reason, StateReason::kImageLate);
}

TEST_F(ReasonOfADrive, IsTheCameraThatRepeatsItself) {
  drive(0, 40);
  image_->repeated = true;
  see(40.0, 0.1);
  const Estimate repeated = see(40.0, 2.0);
  EXPECT_EQ(repeated.why.reason, StateReason::kImageRepeated);
  EXPECT_EQ(repeated.why.figure, 2.0);
}

TEST_F(ReasonOfADrive, ByGlobalFeaturesNoProbabilityIsKnown) {
  LocalizerConfig config = config_;
  config.features = "global";
  make(config);
  const Estimate estimate = see(20.0);
  EXPECT_FALSE(estimate.threshold);
  EXPECT_TRUE(std::isnan(estimate.belief.off_map));
  EXPECT_FALSE(estimate.belief.rival);
}

}  // namespace
}  // namespace visual_localization
