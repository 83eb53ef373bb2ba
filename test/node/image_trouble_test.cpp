#include <gtest/gtest.h>

#include "node/localizer_diagnostics.h"

namespace visual_localization {
namespace {

Estimate estimateWith(LocalizationState state, const ImageStatistics& statistics, bool blind = false) {
  Estimate estimate;
  estimate.state = state;
  estimate.image.statistics = statistics;
  estimate.evidence.blind = blind;
  estimate.image.features_extracted = estimate.image.features_kept = blind ? 4 : 300;
  return estimate;
}

constexpr ImageStatistics kFine{110.0, 50.0, 1.0};
constexpr auto kLost = LocalizationState::kUncertain;

TEST(ImageTrouble, AGoodImageIsNoneWhereverTheRobotIs) {
  EXPECT_EQ(imageTrouble(estimateWith(LocalizationState::kTracking, kFine)), "");
  EXPECT_EQ(imageTrouble(estimateWith(kLost, kFine)), "");
}

TEST(ImageTrouble, WhatIsRecognisedIsAllRight) {
  EXPECT_EQ(imageTrouble(estimateWith(LocalizationState::kTracking, {7.0, 3.0, 1.4})), "");
}

TEST(ImageTrouble, SaysWhatAnImageOfNoUseIsLike) {
  EXPECT_EQ(imageTrouble(estimateWith(kLost, {7.2, 2.0, 1.0}, true)),
            "4 features in the image, mean grey level 7 of 255, contrast 2: dark or covered?");
  EXPECT_EQ(imageTrouble(estimateWith(kLost, {250.0, 10.0, 1.0}, true)),
            "4 features in the image, mean grey level 250 of 255, contrast 10: overexposed?");
  EXPECT_NE(imageTrouble(estimateWith(kLost, {120.0, 3.0, 1.0}, true)).find("fog"), std::string::npos);
  EXPECT_NE(imageTrouble(estimateWith(kLost, kFine, true)).find("blurred"), std::string::npos);
}

TEST(ImageTrouble, TellsFeaturesOfUseFromAll) {
  Estimate estimate = estimateWith(kLost, kFine, true);
  estimate.image.features_extracted = 250;
  EXPECT_EQ(imageTrouble(estimate).find("4 of 250 features in the image left after pruning, "), 0U);
  estimate.evidence.features = FeatureKind::kGlobal;
  EXPECT_EQ(imageTrouble(estimate).find("Hardly any structure in the image, "), 0U);
}

TEST(ImageTrouble, AFrozenCameraIsOneWhateverItShows) {
  Estimate estimate = estimateWith(kLost, kFine);
  estimate.repeats = 11;
  EXPECT_EQ(imageTrouble(estimate), "") << "not for so long";
  estimate.frozen = true;
  EXPECT_EQ(imageTrouble(estimate), "The camera has sent the same image 12 times: frozen?");
  estimate.image.statistics = {0.0, 0.0, 1.0};
  EXPECT_EQ(imageTrouble(estimate),
            "The camera has sent the same image 12 times, mean grey level 0 of 255, contrast 0: dark or covered?");
}

TEST(ImageTrouble, AnotherAspectRatioMayBeWhyNothingIsRecognised) {
  EXPECT_EQ(imageTrouble(estimateWith(kLost, {110.0, 50.0, 0.75})),
            "Aspect ratio of the images differs from the map's by a factor of 1.33: another camera?");
}

}  // namespace
}  // namespace visual_localization
