#include "features/displacement_votes.h"

#include <algorithm>
#include <cstddef>
#include <limits>
#include <random>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "test/support/synthetic.h"

namespace visual_localization {
namespace {

using test::randomFeatures;

LocalFeatures movedTo(const LocalFeatures& features, Keypoints keypoints) {
  return LocalFeatures(std::move(keypoints), features.bytes());
}

/// `count` features anywhere in an image of 640 x 480 pixels.
LocalFeatures scattered(std::size_t count, std::uint32_t seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> x(0.0F, 640.0F);
  std::uniform_real_distribution<float> y(0.0F, 480.0F);
  std::vector<Keypoint> keypoints(count);
  for (Keypoint& keypoint : keypoints) keypoint = {x(random), y(random), 4.0F, 0.0F};
  return movedTo(randomFeatures(count, seed), std::move(keypoints));
}

LocalFeatures shifted(const LocalFeatures& features, std::size_t count, float right_px, float down_px) {
  std::vector<Keypoint> keypoints = features.keypoints().list();
  for (std::size_t i = 0; i < count; ++i) {
    keypoints[i].x_px += right_px;
    keypoints[i].y_px += down_px;
  }
  return movedTo(features, std::move(keypoints));
}

std::vector<FeatureMatch> oneToOne(std::size_t count) {
  std::vector<FeatureMatch> matches;
  for (std::uint32_t i = 0; i < count; ++i) matches.push_back({i, i});
  return matches;
}

std::size_t votes(const LocalFeatures& a, const LocalFeatures& b, std::vector<FeatureMatch> matches,
                  double width_px = 640.0) {
  keepLargestVote(a, b, width_px, matches);
  return matches.size();
}

/// By trying the box at every pair of displacements.
std::size_t votesByTrying(const LocalFeatures& a, const LocalFeatures& b) {
  std::size_t most = 0;
  const auto right = [&](std::size_t i) { return b.keypoints()[i].x_px - a.keypoints()[i].x_px; };
  const auto down = [&](std::size_t i) { return std::lrint(b.keypoints()[i].y_px - a.keypoints()[i].y_px); };
  for (std::size_t i = 0; i < a.size(); ++i) {
    for (std::size_t j = 0; j < a.size(); ++j) {
      std::size_t inside = 0;
      for (std::size_t k = 0; k < a.size(); ++k) {
        inside += right(k) >= right(i) && right(k) - right(i) <= 24.0F && down(k) >= down(j) && down(k) - down(j) < 16;
      }
      most = std::max(most, inside);
    }
  }
  return most;
}

TEST(DisplacementVotes, KeepWhatMovedAlike) {
  const LocalFeatures a = scattered(60, 1);
  const LocalFeatures b = shifted(shifted(a, 60, 300.0F, -200.0F), 40, -250.0F, 170.0F);  // the first 40: by 50, -30
  std::vector<FeatureMatch> matches = oneToOne(60);
  keepLargestVote(a, b, 640.0, matches);
  ASSERT_EQ(matches.size(), 40u);
  for (std::uint32_t i = 0; i < 40; ++i) EXPECT_EQ(matches[i].a, i);
}

TEST(DisplacementVotes, AreAsManyAsTryingEveryBoxFinds) {
  for (std::uint32_t seed = 1; seed <= 20; ++seed) {
    const LocalFeatures a = scattered(60, seed);
    const LocalFeatures b = movedTo(a, scattered(60, seed + 100).keypoints());
    const LocalFeatures c = shifted(b, 0, 0.0F, 0.0F);
    EXPECT_EQ(votes(a, c, oneToOne(60)), votesByTrying(a, c)) << seed;
  }
}

TEST(DisplacementVotes, AreTheSameBothWays) {
  for (std::uint32_t seed = 1; seed <= 20; ++seed) {
    const LocalFeatures a = scattered(80, seed);
    const LocalFeatures b = movedTo(a, scattered(80, seed + 100).keypoints());
    EXPECT_EQ(votes(a, b, oneToOne(80)), votes(b, a, oneToOne(80)));
  }
}

TEST(DisplacementVotes, TheBoxGrowsWithTheImage) {
  const LocalFeatures a = scattered(20, 3);
  const LocalFeatures b = shifted(a, 10, 20.0F, 0.0F);
  EXPECT_EQ(votes(a, b, oneToOne(20)), 20u);         // 24 pixels of 640
  EXPECT_EQ(votes(a, b, oneToOne(20), 320.0), 10u);  // 12 of 320
}

TEST(DisplacementVotes, SurviveWhatAMapMayClaim) {
  const LocalFeatures a = scattered(4, 5);
  std::vector<Keypoint> keypoints = a.keypoints().list();
  keypoints[0].x_px = std::numeric_limits<float>::quiet_NaN();
  keypoints[1].y_px = std::numeric_limits<float>::infinity();
  keypoints[2].y_px = 1e30F;
  EXPECT_EQ(votes(a, movedTo(a, keypoints), oneToOne(4)), 1u);
  EXPECT_EQ(votes(a, a, {}), 0u);
}

TEST(MatchMutual, AsksForNoDistinctNeighbour) {
  const LocalFeatures a = randomFeatures(30, 7);
  std::vector<std::size_t> twice;
  for (std::size_t i = 0; i < 30; ++i) twice.insert(twice.end(), {i, i});
  std::vector<FeatureMatch> matches;
  matchMutual(a, a.subset(twice), 1.0, matches);
  EXPECT_EQ(matches.size(), 30u);
  EXPECT_TRUE(matchSymmetric(a, a.subset(twice), 0.6).empty());
}

TEST(MatchMutual, LooksNoFartherUpOrDown) {
  const LocalFeatures a = scattered(30, 7);
  const LocalFeatures lower = movedTo(a, shifted(a, 30, 0.0F, 90.0F).keypoints());
  std::vector<FeatureMatch> matches;
  matchBy(MatchConfig{0.6, "votes"}, a, lower, 640.0, 0.15, matches);
  EXPECT_EQ(matches.size(), 30u);
  matchBy(MatchConfig{0.6, "votes"}, a, lower, 320.0, 0.15, matches);
  EXPECT_LT(matches.size(), 10u) << "48 pixels at this width";
}

}  // namespace
}  // namespace visual_localization
