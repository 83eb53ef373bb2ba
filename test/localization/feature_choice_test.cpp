#include "visual_localization/localization/feature_choice.h"

#include <string>
#include <utility>

#include <gtest/gtest.h>

namespace visual_localization {
namespace {

constexpr FeatureKind kSift = FeatureKind::kLocal;
constexpr FeatureKind kGlobal = FeatureKind::kGlobal;

FeatureKind after(FeatureChoice& choice, double sigma_x, double sigma_y) {
  choice.update({sigma_x, sigma_y}, true, false);
  return choice.next();
}

/// A hybrid choice whose next image is compared by `kind`.
FeatureChoice hybridAt(FeatureKind kind, const HybridConfig& config = {}) {
  FeatureChoice choice("hybrid", config);
  if (kind == kGlobal) choice.update({0.0, 0.0}, true, false);
  EXPECT_EQ(choice.next(), kind);
  return choice;
}

TEST(FeatureChoice, HybridBeginsWithSift) { EXPECT_EQ(FeatureChoice("hybrid", HybridConfig()).next(), kSift); }

TEST(FeatureChoice, AfterSiftBothSigmasMustBeBelow) {
  const struct {
    double x, y;
    FeatureKind next;
  } cases[] = {{6.99, 6.99, kGlobal}, {7.0, 0.0, kSift},   {0.0, 7.0, kSift},   {7.01, 0.0, kSift},
               {0.0, 7.01, kSift},    {6.0, 6.0, kGlobal}, {0.0, 0.0, kGlobal}, {50.0, 50.0, kSift}};
  for (const auto& [x, y, next] : cases) {
    FeatureChoice choice = hybridAt(kSift);
    EXPECT_EQ(after(choice, x, y), next) << x << " " << y;
  }
}

TEST(FeatureChoice, AfterGlobalFeaturesOneSigmaAboveIsEnough) {
  const struct {
    double x, y;
    FeatureKind next;
  } cases[] = {{5.49, 5.49, kGlobal}, {5.5, 5.5, kGlobal}, {5.51, 0.0, kSift},
               {0.0, 5.51, kSift},    {6.0, 6.0, kSift},   {0.0, 0.0, kGlobal}};
  for (const auto& [x, y, next] : cases) {
    FeatureChoice choice = hybridAt(kGlobal);
    EXPECT_EQ(after(choice, x, y), next) << x << " " << y;
  }
}

/// The papers' d_global is the smaller one: a cloud between the two takes turns.
TEST(FeatureChoice, BetweenThePapersThresholdsTheKindsTakeTurns) {
  FeatureChoice choice = hybridAt(kSift);
  for (int i = 0; i < 4; ++i) {
    EXPECT_EQ(after(choice, 6.0, 1.0), kGlobal);
    EXPECT_EQ(after(choice, 1.0, 6.0), kSift);
  }
}

TEST(FeatureChoice, BetweenThresholdsTheOtherWayRoundTheKindStays) {
  HybridConfig config;
  config.sift_below_m = 3.0;
  config.global_above_m = 8.0;
  for (const FeatureKind kind : {kSift, kGlobal}) {
    FeatureChoice choice = hybridAt(kind, config);
    for (int i = 0; i < 4; ++i) EXPECT_EQ(after(choice, 5.0, 7.0), kind);
  }
}

TEST(FeatureChoice, AChoiceThatIsFixedNeverChanges) {
  for (const FeatureKind kind : {kSift, kGlobal}) {
    FeatureChoice choice(kind == kSift ? "sift" : "global", HybridConfig());
    EXPECT_EQ(choice.next(), kind);
    for (const double sigma : {0.0, 6.0, 100.0, 6.0, 0.0}) EXPECT_EQ(after(choice, sigma, sigma), kind);
    choice.update({0.0, 0.0}, false, true);
    EXPECT_EQ(choice.next(), kind);
    choice.reset();
    EXPECT_EQ(choice.next(), kind);
  }
}

TEST(FeatureChoice, InDoubtASmallCloudIsNoReasonForGlobalFeatures) {
  for (const FeatureKind kind : {kSift, kGlobal}) {
    FeatureChoice choice = hybridAt(kind);
    choice.update({1.0, 1.0}, true, true);
    EXPECT_EQ(choice.next(), kSift);
    EXPECT_EQ(after(choice, 1.0, 1.0), kGlobal) << "no longer in doubt";
  }
}

/// The kinds of features of the next images, whose evidence is `confirmed`.
std::string kindsOf(FeatureChoice& choice, int images, bool confirmed) {
  std::string kinds;
  for (int i = 0; i < images; ++i) {
    kinds += choice.next() == kSift ? 'S' : 'g';
    choice.update({1.0, 1.0}, confirmed, false);
  }
  return kinds;
}

TEST(FeatureChoice, SiftLooksAfterASmallCloudEverySoManyImages) {
  HybridConfig config;
  config.sift_every = 4;
  FeatureChoice choice("hybrid", config);
  EXPECT_EQ(kindsOf(choice, 10, true), "SgggSgggSg");
  EXPECT_EQ(kindsOf(choice, 6, false), "ggSSSS") << "nothing confirms the position";
  EXPECT_EQ(kindsOf(choice, 3, true), "Sgg");

  for (const auto& [every, kinds] : {std::pair{1, "SSSSSS"}, std::pair{2, "SgSgSg"}, std::pair{3, "SggSgg"}}) {
    config.sift_every = every;
    FeatureChoice other("hybrid", config);
    EXPECT_EQ(kindsOf(other, 6, true), kinds);
  }

  config.sift_every = 0;
  choice.configure("hybrid", config);
  EXPECT_EQ(kindsOf(choice, 10, false), "gggggggggg") << "as in the paper";
}

TEST(FeatureChoice, OtherThresholdsDoNotDelayTheNextLook) {
  HybridConfig config;
  config.sift_every = 4;
  FeatureChoice choice("hybrid", config);
  EXPECT_EQ(kindsOf(choice, 2, true), "Sg");
  config.global_above_m += 1.0;
  choice.configure("hybrid", config);
  EXPECT_EQ(kindsOf(choice, 4, true), "ggSg");
}

TEST(FeatureChoice, ResetBeginsWithSiftAgain) {
  FeatureChoice choice = hybridAt(kGlobal);
  choice.reset();
  EXPECT_EQ(choice.next(), kSift);
  EXPECT_EQ(after(choice, 1.0, 1.0), kGlobal);
}

TEST(FeatureChoice, OtherThresholdsKeepTheChoiceOtherFeaturesDoNot) {
  FeatureChoice choice = hybridAt(kGlobal);
  HybridConfig wider;
  wider.global_above_m = 20.0;
  choice.configure("hybrid", wider);
  EXPECT_EQ(choice.next(), kGlobal);
  EXPECT_EQ(after(choice, 10.0, 10.0), kGlobal);
  choice.configure("sift", wider);
  EXPECT_EQ(choice.next(), kSift);
  EXPECT_EQ(after(choice, 0.0, 0.0), kSift);
  choice.configure("global", wider);
  EXPECT_EQ(choice.next(), kGlobal);
}

}  // namespace
}  // namespace visual_localization
