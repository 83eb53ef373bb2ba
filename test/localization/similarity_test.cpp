#include <stdexcept>

#include <gtest/gtest.h>

#include "test/support/synthetic.h"
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

TEST(SiftSimilarity, SymmetricCountsMatchesOverTheSmallerSet) {
  const SiftSimilarity similarity({0.6, "symmetric"}, SimilarityConfig());
  const SiftFeatures four = featuresOf({kX, kY, kU, kV});
  const SiftFeatures three = featuresOf({kX, kY, kZ});
  const Score score = similarity.compare(four, three);
  EXPECT_EQ(score.matches, 2u);
  EXPECT_DOUBLE_EQ(score.similarity, 2.0 / 3.0);
  EXPECT_DOUBLE_EQ(similarity.compare(three, four).similarity, 2.0 / 3.0);
}

TEST(SiftSimilarity, OneWayCountsMatchesOverTheTestImage) {
  const SiftSimilarity similarity({0.6, "one_way"}, SimilarityConfig());
  const SiftFeatures four = featuresOf({kX, kY, kU, kV});
  const SiftFeatures three = featuresOf({kX, kY, kZ});
  EXPECT_DOUBLE_EQ(similarity.compare(four, three).similarity, 0.5);
  EXPECT_DOUBLE_EQ(similarity.compare(three, four).similarity, 2.0 / 3.0);
}

TEST(SiftSimilarity, AnImageIsFullySimilarToItself) {
  const SiftFeatures features = test::randomFeatures(40, 11);
  for (const char* mode : {"symmetric", "one_way"}) {
    EXPECT_DOUBLE_EQ(SiftSimilarity({0.6, mode}, SimilarityConfig()).compare(features, features).similarity, 1.0);
  }
}

TEST(SiftSimilarity, FewerThanTwoFeaturesAreNoEvidence) {
  const SiftSimilarity similarity({0.6, "symmetric"}, SimilarityConfig());
  const SiftFeatures one = featuresOf({kX});
  const SiftFeatures two = featuresOf({kX, kY});
  EXPECT_EQ(similarity.compare(one, two).similarity, 0.0);
  EXPECT_EQ(similarity.compare(two, one).similarity, 0.0);
  EXPECT_EQ(similarity.compare({}, {}).similarity, 0.0);
}

TEST(ScoreCache, ComparesEachTrainingImageOnceAndCounts) {
  ScoreCache scores(10);
  int calls = 0;
  scores.startImage([&calls](std::size_t image) {
    ++calls;
    return Score{0.1 * static_cast<double>(image), 0.0, image};
  });
  for (int round = 0; round < 3; ++round) {
    EXPECT_DOUBLE_EQ(scores[3].similarity, 0.3);
    EXPECT_EQ(scores[7].matches, 7u);
  }
  EXPECT_EQ(calls, 2);
  EXPECT_EQ(scores.comparisons(), 2u);
}

TEST(ScoreCache, ANewImageForgetsTheOldScores) {
  ScoreCache scores(2);
  scores.startImage([](std::size_t) { return Score{0.1, 0.1, 1}; });
  EXPECT_EQ(scores[1].similarity, 0.1);
  scores.startImage([](std::size_t) { return Score{0.2, 0.2, 2}; });
  EXPECT_EQ(scores.comparisons(), 0u);
  EXPECT_EQ(scores[1].similarity, 0.2);
}

TEST(ScoreCache, AnImageBeyondTheMapIsAnError) {
  ScoreCache scores(2);
  scores.startImage([](std::size_t) { return Score{}; });
  EXPECT_THROW(scores[2], std::out_of_range);
}

}  // namespace
}  // namespace visual_localization
