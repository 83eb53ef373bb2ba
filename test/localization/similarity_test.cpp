#include "visual_localization/localization/similarity.h"

#include <stdexcept>

#include <gtest/gtest.h>

#include "test/support/synthetic.h"
#include "visual_localization/localization/estimate.h"
#include "visual_localization/localization/scores.h"

namespace visual_localization {
namespace {

using test::descriptor;
using test::featuresOf;

const auto kX = descriptor({200});
const auto kY = descriptor({0, 200});
const auto kZ = descriptor({0, 0, 200});
const auto kU = descriptor({0, 0, 0, 200});
const auto kV = descriptor({0, 0, 0, 0, 200});

TEST(LocalSimilarity, SymmetricCountsMatchesOverTheSmallerSet) {
  const LocalSimilarity similarity({0.6, "symmetric"}, SimilarityConfig());
  const LocalFeatures four = featuresOf({kX, kY, kU, kV});
  const LocalFeatures three = featuresOf({kX, kY, kZ});
  const Score score = similarity.compare(four, three);
  EXPECT_EQ(score.matches, 2u);
  EXPECT_DOUBLE_EQ(score.similarity, 2.0 / 3.0);
  EXPECT_DOUBLE_EQ(similarity.compare(three, four).similarity, 2.0 / 3.0);
}

TEST(LocalSimilarity, OneWayCountsMatchesOverTheTestImage) {
  const LocalSimilarity similarity({0.6, "one_way"}, SimilarityConfig());
  const LocalFeatures four = featuresOf({kX, kY, kU, kV});
  const LocalFeatures three = featuresOf({kX, kY, kZ});
  EXPECT_DOUBLE_EQ(similarity.compare(four, three).similarity, 0.5);
  EXPECT_DOUBLE_EQ(similarity.compare(three, four).similarity, 2.0 / 3.0);
}

TEST(LocalSimilarity, AnImageIsFullySimilarToItself) {
  const LocalFeatures features = test::randomFeatures(40, 11);
  for (const char* mode : {"votes", "symmetric", "one_way"}) {
    EXPECT_DOUBLE_EQ(LocalSimilarity({0.6, mode}, SimilarityConfig()).compare(features, features).similarity, 1.0);
  }
}

TEST(LocalSimilarity, FewerThanTwoFeaturesAreNoEvidence) {
  const LocalSimilarity similarity({0.6, "symmetric"}, SimilarityConfig());
  const LocalFeatures one = featuresOf({kX});
  const LocalFeatures two = featuresOf({kX, kY});
  EXPECT_EQ(similarity.compare(one, two).similarity, 0.0);
  EXPECT_EQ(similarity.compare(two, one).similarity, 0.0);
  EXPECT_EQ(similarity.compare({}, {}).similarity, 0.0);
  EXPECT_EQ(similarity.compare({}, two).similarity, 0.0);
  EXPECT_EQ(similarity.compare(two, {}).similarity, 0.0);
}

TEST(LocalSimilarity, TwoFeaturesAreEnough) {
  for (const char* mode : {"symmetric", "one_way"}) {
    const LocalSimilarity similarity({0.6, mode}, SimilarityConfig());
    const LocalFeatures two = featuresOf({kX, kY});
    const LocalFeatures three = featuresOf({kX, kY, kZ});
    EXPECT_DOUBLE_EQ(similarity.compare(two, two).similarity, 1.0) << mode;
    EXPECT_DOUBLE_EQ(similarity.compare(two, three).similarity, 1.0) << mode;
    EXPECT_EQ(similarity.compare(three, two).matches, 2U) << mode;
  }
}

TEST(Estimate, NamesItsFeatures) {
  Estimate estimate;
  EXPECT_EQ(estimate.featuresName(), "SIFT");
  estimate.image.local_features = "LEARNED";
  EXPECT_EQ(estimate.featuresName(), "LEARNED");
  estimate.evidence.features = FeatureKind::kGlobal;
  EXPECT_EQ(estimate.featuresName(), "GLOBAL");
}

TEST(Scores, ComparesEachTrainingImageOnceByEachKindAndCounts) {
  Scores scores(10);
  int by_sift = 0;
  int by_global = 0;
  scores.startImage(FeatureKind::kLocal, [&](FeatureKind kind, std::size_t image) {
    const bool sift = kind == FeatureKind::kLocal;
    ++(sift ? by_sift : by_global);
    return Score{(sift ? 0.1 : 0.05) * static_cast<double>(image), 0.0, image};
  });
  for (int repetition = 0; repetition < 3; ++repetition) {
    EXPECT_DOUBLE_EQ(scores[3].similarity, 0.3);
    EXPECT_EQ(scores[7].matches, 7u);
    EXPECT_DOUBLE_EQ(scores.global(3).similarity, 0.15);
  }
  EXPECT_EQ(by_sift, 2);
  EXPECT_EQ(by_global, 1);
  EXPECT_EQ(scores.comparisons(), 2u);
  EXPECT_EQ(scores.swept(), 1u);
}

TEST(Scores, ANewImageForgetsTheOldScores) {
  Scores scores(2);
  scores.startImage(FeatureKind::kLocal, [](FeatureKind, std::size_t) { return Score{0.1, 0.1, 1}; });
  EXPECT_EQ(scores[1].similarity, 0.1);
  scores.count({0, 1});
  EXPECT_EQ(scores.comparisons(), 2u);
  scores.startImage(FeatureKind::kGlobal, [](FeatureKind, std::size_t) { return Score{0.2, 0.2, 2}; });
  EXPECT_EQ(scores.comparisons(), 0u);
  EXPECT_EQ(scores[1].similarity, 0.2);
  EXPECT_EQ(scores.swept(), 0u) << "compared for a particle";
}

TEST(Scores, AnImageBeyondTheMapIsAnError) {
  Scores scores(2);
  scores.startImage(FeatureKind::kLocal, [](FeatureKind, std::size_t) { return Score{}; });
  EXPECT_THROW(scores[2], std::out_of_range);
  EXPECT_THROW(scores.global(2), std::out_of_range);
}

}  // namespace
}  // namespace visual_localization
