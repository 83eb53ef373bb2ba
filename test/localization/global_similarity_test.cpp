#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "visual_localization/localization/similarity.h"
#include "visual_localization/parameters/parameters.h"

namespace visual_localization {
namespace {

/// Half of everything in bin 0 and half in `wgoh_bin` of the WGOH, `wgii_bin` of the WGII.
GlobalFeatures featuresAt(std::size_t wgoh_bin, std::size_t wgii_bin) {
  GlobalFeatures features;
  features.wgoh[0] += 0.5F;
  features.wgoh[wgoh_bin] += 0.5F;
  features.wgii[0] += 0.25F;
  features.wgii[wgii_bin] += 0.75F;
  return features;
}

TEST(GlobalSimilarity, IsTheProductOfBothIntersections) {
  const GlobalSimilarity similarity{SimilarityConfig()};
  const GlobalFeatures current = featuresAt(5, 9);
  EXPECT_DOUBLE_EQ(similarity.compare(current, current).similarity, 1.0);
  EXPECT_DOUBLE_EQ(similarity.compare(current, featuresAt(6, 9)).similarity, 0.5);
  EXPECT_DOUBLE_EQ(similarity.compare(current, featuresAt(5, 10)).similarity, 0.25);
  EXPECT_DOUBLE_EQ(similarity.compare(current, featuresAt(6, 10)).similarity, 0.125);
}

TEST(GlobalSimilarity, TheQueryIsTheCurrentImage) {
  GlobalFeatures faint = featuresAt(5, 9);
  for (float& value : faint.wgoh) value *= 0.5F;
  const GlobalSimilarity similarity{SimilarityConfig()};
  EXPECT_DOUBLE_EQ(similarity.compare(faint, featuresAt(5, 9)).similarity, 1.0);
  EXPECT_DOUBLE_EQ(similarity.compare(featuresAt(5, 9), faint).similarity, 0.5);
}

TEST(GlobalSimilarity, AnImageWithoutGradientsResemblesNothing) {
  const GlobalSimilarity similarity{SimilarityConfig()};
  const Score score = similarity.compare(GlobalFeatures(), featuresAt(5, 9));
  EXPECT_EQ(score.similarity, 0.0);
  EXPECT_EQ(score.weight, 0.0);
  EXPECT_FALSE(score.recognised);
}

TEST(GlobalSimilarity, AWeightIsTheSimilarityToThePowerOfTwenty) {
  const GlobalSimilarity similarity{SimilarityConfig()};
  EXPECT_NEAR(similarity.scoreOf(0.9).weight, 0.12157665, 1e-8);
  EXPECT_EQ(similarity.scoreOf(0.9).similarity, 0.9);
  EXPECT_EQ(similarity.scoreOf(1.0).weight, 1.0);
  EXPECT_EQ(similarity.scoreOf(0.0).weight, 0.0);
  EXPECT_EQ(similarity.scoreOf(0.9).matches, 0U);
  SimilarityConfig config;
  config.global_exponent = 1.0;
  EXPECT_DOUBLE_EQ(GlobalSimilarity(config).scoreOf(0.3).weight, 0.3);
}

TEST(GlobalSimilarity, IsRecognisedFromTheThresholdOn) {
  SimilarityConfig config;
  config.global_recognised = 0.75;
  const GlobalSimilarity similarity(config);
  EXPECT_TRUE(similarity.scoreOf(0.75).recognised);
  EXPECT_FALSE(similarity.scoreOf(std::nextafter(0.75, 0.0)).recognised);
}

TEST(LocalSimilarity, AKnownSimilarityMeansTheSameAsAComparedOne) {
  SimilarityConfig config;
  config.sift_recognised = 0.25;
  config.global_recognised = 0.9;  // none of its business
  const LocalSimilarity similarity(MatchConfig(), config);
  const Score good = similarity.scoreOf(0.25, 12, 1.5);
  EXPECT_EQ(good.similarity, 0.25);
  EXPECT_EQ(good.weight, 0.25);
  EXPECT_EQ(good.matches, 12U);
  EXPECT_EQ(good.scale, 1.5);
  EXPECT_TRUE(good.recognised);
  EXPECT_FALSE(similarity.scoreOf(std::nextafter(0.25, 0.0), 12, 1.5).recognised);
}

TEST(SimilarityConfig, IsInRangeByDefaultAndSaysWhatIsNot) {
  SimilarityConfig config;
  EXPECT_TRUE(violationsOf(config).empty());
  config.sift_recognised = 1.1;
  EXPECT_THAT(violationsOf(config), ::testing::ElementsAre(::testing::HasSubstr("sift_recognised")));
}

}  // namespace
}  // namespace visual_localization
