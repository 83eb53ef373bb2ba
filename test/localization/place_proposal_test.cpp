#include "visual_localization/localization/place_proposal.h"

#include <numeric>
#include <set>
#include <vector>

#include <gtest/gtest.h>

namespace visual_localization {
namespace {

std::vector<int> drawMany(PlaceProposal& proposal, std::size_t training_images, int draws, std::uint32_t seed) {
  Random random(seed);
  std::vector<int> counts(training_images, 0);
  for (int i = 0; i < draws; ++i) ++counts.at(proposal.draw(random));
  return counts;
}

/// Pearson's statistic; with `counts.size() - 1` degrees of freedom when the counts follow the weights.
double chiSquared(const std::vector<int>& counts, const std::vector<double>& weights) {
  const double draws = std::accumulate(counts.begin(), counts.end(), 0.0);
  const double total = std::accumulate(weights.begin(), weights.end(), 0.0);
  double sum = 0.0;
  for (std::size_t i = 0; i < counts.size(); ++i) {
    const double expected = draws * weights[i] / total;
    sum += (counts[i] - expected) * (counts[i] - expected) / expected;
  }
  return sum;
}

TEST(PlaceProposal, DrawsInProportionToTheWeights) {
  const std::vector<double> weights{0.05, 0.2, 0.1, 0.4, 0.25, 0.01};
  PlaceProposal proposal(weights.size(), 100);
  proposal.startImage([&](std::size_t i) { return weights[i]; });
  EXPECT_LT(chiSquared(drawMany(proposal, weights.size(), 20000, 1), weights), 20.5);  // 99.9 % of 5 degrees
}

TEST(PlaceProposal, NeverDrawsWhatHasNoWeight) {
  PlaceProposal proposal(6, 100);
  proposal.startImage([](std::size_t i) { return i % 2 == 1 ? 1e-30 : 0.0; });
  const std::vector<int> counts = drawMany(proposal, 6, 3000, 2);
  for (const std::size_t i : {0U, 2U, 4U}) EXPECT_EQ(counts[i], 0);
  for (const std::size_t i : {1U, 3U, 5U}) EXPECT_GT(counts[i], 800);
}

TEST(PlaceProposal, DrawsAnyWhenNothingHasWeight) {
  PlaceProposal proposal(8, 100);
  proposal.startImage([](std::size_t) { return 0.0; });
  EXPECT_LT(chiSquared(drawMany(proposal, 8, 20000, 3), std::vector<double>(8, 1.0)), 24.3);  // 99.9 % of 7 degrees
}

TEST(PlaceProposal, WeighsOnceAnImageAndOnlyWhenAsked) {
  std::vector<int> weighed(10, 0);
  PlaceProposal proposal(10, 100);
  const auto weigh = [&weighed](std::size_t i) { return static_cast<double>(++weighed.at(i)); };
  proposal.startImage(weigh);
  EXPECT_EQ(weighed, std::vector<int>(10, 0));
  EXPECT_FALSE(proposal.wasUsed());
  drawMany(proposal, 10, 50, 4);
  EXPECT_EQ(weighed, std::vector<int>(10, 1));
  EXPECT_TRUE(proposal.wasUsed());
  proposal.startImage(weigh);
  EXPECT_FALSE(proposal.wasUsed());
  proposal.startImage(weigh);
  drawMany(proposal, 10, 50, 5);
  EXPECT_EQ(weighed, std::vector<int>(10, 2));
}

/// The training images that `images` images weigh.
std::set<std::size_t> weighedBy(PlaceProposal& proposal, int images) {
  std::set<std::size_t> weighed;
  Random random(1);
  for (int image = 0; image < images; ++image) {
    proposal.startImage([&weighed](std::size_t i) {
      weighed.insert(i);
      return 1.0;
    });
    proposal.draw(random);
  }
  return weighed;
}

TEST(PlaceProposal, SeesAllOfAMapInMemoryWithTime) {
  PlaceProposal proposal(1003, 10);
  EXPECT_EQ(weighedBy(proposal, 101).size(), 1003U);
}

TEST(PlaceProposal, SeesNoMoreThanCanBeKept) {
  PlaceProposal proposal(1000, 10, 45);
  const std::set<std::size_t> weighed = weighedBy(proposal, 300);
  EXPECT_EQ(weighed.size(), 40U);
  EXPECT_LT(*weighed.begin(), 26U) << "spread over the map";
  EXPECT_GE(*weighed.rbegin(), 974U);
  PlaceProposal nothing_kept(1000, 10, 0);
  EXPECT_EQ(weighedBy(nothing_kept, 300).size(), 10U);
}

TEST(PlaceProposal, ANewImageForgetsTheOldWeights) {
  PlaceProposal proposal(10, 100);
  Random random(6);
  for (const std::size_t only : {7U, 2U, 9U}) {
    proposal.startImage([only](std::size_t i) { return i == only ? 0.3 : 0.0; });
    for (int i = 0; i < 20; ++i) EXPECT_EQ(proposal.draw(random), only);
  }
}

TEST(PlaceProposal, SeesAllOfALargeMapOverSuccessiveImages) {
  constexpr std::size_t kMax = 8;
  for (const std::size_t size : {9U, 16U, 17U, 25U, 64U, 100U}) {
    const std::size_t images = (size + kMax - 1) / kMax;
    PlaceProposal proposal(size, kMax);
    Random random(7);
    for (int round = 0; round < 3; ++round) {
      std::multiset<std::size_t> weighed;
      for (std::size_t image = 0; image < images; ++image) {
        std::set<std::size_t> of_image;
        proposal.startImage([&](std::size_t i) {
          of_image.insert(i);
          return 1.0;
        });
        for (int i = 0; i < 30; ++i) EXPECT_EQ(of_image.count(proposal.draw(random)), 1U);
        EXPECT_LE(of_image.size(), kMax);
        weighed.insert(of_image.begin(), of_image.end());
      }
      ASSERT_EQ(weighed.size(), size);
      for (std::size_t i = 0; i < size; ++i) EXPECT_EQ(weighed.count(i), 1U) << i << " of " << size;
    }
  }
}

TEST(PlaceProposal, ThinnedOutItStillDrawsByWeight) {
  PlaceProposal proposal(30, 10);
  Random random(8);
  std::set<std::size_t> best;
  for (int image = 0; image < 3; ++image) {
    std::set<std::size_t> weighed;
    proposal.startImage([&weighed](std::size_t i) {
      weighed.insert(i);
      return i >= 27 ? 1.0 : 0.0;
    });
    const std::size_t drawn = proposal.draw(random);
    EXPECT_EQ(weighed.count(drawn), 1U);
    best.insert(drawn);
  }
  EXPECT_EQ(best, (std::set<std::size_t>{27, 28, 29}));
}

TEST(PlaceProposal, AMapOfOneImageHasOnePlace) {
  for (const double weight : {0.0, 0.7}) {
    PlaceProposal proposal(1, 1);
    proposal.startImage([weight](std::size_t) { return weight; });
    Random random(9);
    for (int i = 0; i < 10; ++i) EXPECT_EQ(proposal.draw(random), 0U);
  }
}

}  // namespace
}  // namespace visual_localization
