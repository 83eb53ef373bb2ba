#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "localization/pose_verifier.h"

namespace visual_localization {
namespace {

constexpr double kMaxError = 0.01;

void addImage(FocalCheck& check, double scale, double sigma) {
  check.startImage();
  check.add(scale, sigma);
}

TEST(FocalCheck, SaysNothingWithoutImages) {
  const FocalCheck check(kMaxError);
  EXPECT_FALSE(check.confirms());
  EXPECT_FALSE(check.contradicts());
  EXPECT_DOUBLE_EQ(check.scale(), 1.0);
}

TEST(FocalCheck, ConfirmsByOneSureImage) {
  FocalCheck check(kMaxError);
  addImage(check, 1.002, 0.004);
  EXPECT_TRUE(check.confirms());
  EXPECT_FALSE(check.contradicts());
}

TEST(FocalCheck, NeedsMoreThanAnUnsureImage) {
  FocalCheck check(kMaxError);
  addImage(check, 1.02, 0.05);
  EXPECT_FALSE(check.confirms());
  EXPECT_FALSE(check.contradicts()) << "less than one sigma off";
}

TEST(FocalCheck, ContradictsWhatIsFarOff) {
  FocalCheck check(kMaxError);
  addImage(check, 0.3, 0.2);
  EXPECT_TRUE(check.contradicts()) << "an image far off, though unsure";
  EXPECT_FALSE(check.confirms());
}

TEST(FocalCheck, FindsASmallErrorOverManyImages) {
  FocalCheck check(kMaxError);
  addImage(check, 1.014, 0.004);
  EXPECT_FALSE(check.contradicts());
  for (int i = 0; i < 20; ++i) addImage(check, 1.014, 0.004);
  EXPECT_TRUE(check.contradicts());
  EXPECT_NEAR(check.scale(), 1.014, 1e-9);
}

TEST(FocalCheck, WeighsBySigma) {
  FocalCheck check(kMaxError);
  addImage(check, 1.0, 0.002);
  addImage(check, 1.3, 0.1);
  EXPECT_NEAR(check.scale(), 1.0, 0.001);
  EXPECT_TRUE(check.confirms());
}

TEST(FocalCheck, ForgetsOldImages) {
  FocalCheck check(kMaxError);
  for (int i = 0; i < 20; ++i) addImage(check, 1.1, 0.004);
  ASSERT_TRUE(check.contradicts());
  for (int i = 0; i < 20; ++i) addImage(check, 1.0, 0.004);
  EXPECT_TRUE(check.confirms());
}

TEST(FocalCheck, TheLastTwentyImagesCount) {
  FocalCheck check(kMaxError);
  addImage(check, 1.1, 0.004);
  for (int i = 0; i < 19; ++i) addImage(check, 1.0, 0.004);
  EXPECT_NEAR(check.scale(), 1.005, 1e-9);
  addImage(check, 1.0, 0.004);
  EXPECT_NEAR(check.scale(), 1.0, 1e-9);
}

TEST(FocalCheck, TheLastWordOfAnImageCounts) {
  FocalCheck check(kMaxError);
  addImage(check, 1.0, 0.004);
  addImage(check, 1.3, 0.004);
  check.add(1.002, 0.004);
  EXPECT_NEAR(check.scale(), 1.001, 1e-9);
  check.reset();
  check.add(1.002, 0.004);
  EXPECT_NEAR(check.scale(), 1.002, 1e-9);
}

TEST(FocalCheck, IgnoresWhatIsNotFinite) {
  FocalCheck check(kMaxError);
  addImage(check, std::numeric_limits<double>::quiet_NaN(), 0.004);
  addImage(check, 1.0, std::numeric_limits<double>::infinity());
  addImage(check, 1.0, std::numeric_limits<double>::quiet_NaN());
  EXPECT_FALSE(check.confirms());
  EXPECT_DOUBLE_EQ(check.scale(), 1.0);
  addImage(check, 1.002, 0.004);
  EXPECT_DOUBLE_EQ(check.scale(), 1.002);
}

TEST(FocalCheck, WhatContradictsDoesNotConfirm) {
  FocalCheck check(kMaxError);
  for (int i = 0; i < 20; ++i) addImage(check, 1.05, 0.004);
  EXPECT_TRUE(check.contradicts());
  EXPECT_FALSE(check.confirms()) << "however sure it is";
}

// Each image counts with hypot(sigma, 0.003).
TEST(FocalCheck, IsSureWhenTheMeanIsKnownToAHundredth) {
  FocalCheck check(kMaxError);
  const double sigma = std::sqrt(std::pow(0.0205, 2) - std::pow(0.003, 2));  // 0.0205 / sqrt(n) <= 0.01 from 5 on
  for (int images = 1; images <= 6; ++images) {
    addImage(check, 1.0, sigma);
    EXPECT_EQ(check.confirms(), images >= 5) << images;
  }
}

TEST(FocalCheck, ContradictsBeyondTheAllowedErrorAndThreeSigmas) {
  const double sigma = std::sqrt(std::pow(0.005, 2) - std::pow(0.003, 2));
  for (const double off : {0.0249, 0.0251}) {
    for (const double sign : {1.0, -1.0}) {
      FocalCheck check(kMaxError);
      addImage(check, 1.0 + sign * off, sigma);
      EXPECT_EQ(check.contradicts(), off > 0.025) << sign * off;
    }
  }
}

TEST(MissingPoses, TellMuchWhereEveryImageHadOne) {
  MissingPoses missing;
  EXPECT_GT(missing.likelihood(), 0.9) << "nothing is known yet";
  for (int i = 0; i < 100; ++i) missing.add(true, 1.0);
  EXPECT_LT(missing.likelihood(), 0.1);
  missing.add(false, 0.5);
  EXPECT_LT(missing.likelihood(), 0.01) << "two in a row";
  missing.add(true, 1.0);
  EXPECT_GT(missing.likelihood(), 0.01) << "a new row";
}

TEST(MissingPoses, TellNothingWherePlacesHaveNone) {
  MissingPoses missing;
  for (int i = 0; i < 200; ++i) missing.add(false, 0.99);
  EXPECT_GT(missing.likelihood(), 0.99);
}

TEST(MissingPoses, TellLittleWhereOnlySomeHaveOne) {
  MissingPoses missing;
  for (int i = 0; i < 201; ++i) missing.add(i % 4 == 0, 0.99);
  EXPECT_GT(missing.likelihood(), 0.4);
}

}  // namespace
}  // namespace visual_localization
