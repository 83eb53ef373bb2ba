#include <limits>

#include <gtest/gtest.h>

#include "localization/pose_verifier.h"

namespace visual_localization {
namespace {

constexpr double kMaxError = 0.01;

TEST(FocalCheck, SaysNothingWithoutImages) {
  const FocalCheck check(kMaxError);
  EXPECT_FALSE(check.confirms());
  EXPECT_FALSE(check.contradicts());
  EXPECT_DOUBLE_EQ(check.scale(), 1.0);
}

TEST(FocalCheck, ConfirmsByOneSureImage) {
  FocalCheck check(kMaxError);
  check.add(1.002, 0.004);
  EXPECT_TRUE(check.confirms());
  EXPECT_FALSE(check.contradicts());
}

TEST(FocalCheck, NeedsMoreThanAnUnsureImage) {
  FocalCheck check(kMaxError);
  check.add(1.02, 0.05);
  EXPECT_FALSE(check.confirms());
  EXPECT_FALSE(check.contradicts()) << "less than one sigma off";
}

TEST(FocalCheck, ContradictsWhatIsFarOff) {
  FocalCheck check(kMaxError);
  check.add(0.3, 0.2);
  EXPECT_TRUE(check.contradicts()) << "an image far off, though unsure";
  EXPECT_FALSE(check.confirms());
}

TEST(FocalCheck, FindsASmallErrorOverManyImages) {
  FocalCheck check(kMaxError);
  check.add(1.014, 0.004);
  EXPECT_FALSE(check.contradicts());
  for (int i = 0; i < 20; ++i) check.add(1.014, 0.004);
  EXPECT_TRUE(check.contradicts());
  EXPECT_NEAR(check.scale(), 1.014, 1e-9);
}

TEST(FocalCheck, WeighsBySigma) {
  FocalCheck check(kMaxError);
  check.add(1.0, 0.002);
  check.add(1.3, 0.1);
  EXPECT_NEAR(check.scale(), 1.0, 0.001);
  EXPECT_TRUE(check.confirms());
}

TEST(FocalCheck, ForgetsOldImages) {
  FocalCheck check(kMaxError);
  for (int i = 0; i < 20; ++i) check.add(1.1, 0.004);
  ASSERT_TRUE(check.contradicts());
  for (int i = 0; i < 20; ++i) check.add(1.0, 0.004);
  EXPECT_TRUE(check.confirms());
}

TEST(FocalCheck, IgnoresWhatIsNotFinite) {
  FocalCheck check(kMaxError);
  check.add(std::numeric_limits<double>::quiet_NaN(), 0.004);
  check.add(1.0, std::numeric_limits<double>::infinity());
  EXPECT_FALSE(check.confirms());
  EXPECT_DOUBLE_EQ(check.scale(), 1.0);
}

}  // namespace
}  // namespace visual_localization
