#include "geometry/feature_tracks.h"

#include <algorithm>

#include <gtest/gtest.h>

namespace visual_localization {
namespace {

bool operator==(const FeatureObservation& a, const FeatureObservation& b) {
  return a.image == b.image && a.feature == b.feature;
}

bool equal(const FeatureTrack& a, const FeatureTrack& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const auto& x, const auto& y) { return x == y; });
}

const std::vector<std::size_t> kCounts{3, 2, 4};

TEST(FeatureTracks, JoinMatchesOverImages) {
  const auto tracks = tracksOf({{0, 1, {{2, 1}}}, {1, 2, {{1, 3}}}}, kCounts, 3);
  ASSERT_EQ(tracks.size(), 1U);
  EXPECT_TRUE(equal(tracks[0], {{0, 2}, {1, 1}, {2, 3}}));
}

TEST(FeatureTracks, JoinImagesThatAreMatchedOnlyThroughALaterOne) {
  const auto tracks = tracksOf({{0, 2, {{0, 0}}}, {1, 2, {{0, 0}}}}, kCounts, 3);
  ASSERT_EQ(tracks.size(), 1U);
  EXPECT_TRUE(equal(tracks[0], {{0, 0}, {1, 0}, {2, 0}}));
}

TEST(FeatureTracks, AreDroppedWhenTheyShowAnImageTwice) {
  // Features 0 and 1 of the first image are the same thing in the last one, by way of two features of the second.
  const std::vector<ImagePair> pairs{{0, 1, {{0, 0}, {1, 1}, {2, 0}}}, {1, 2, {{0, 2}}}};
  const auto tracks = tracksOf(pairs, kCounts, 2);
  ASSERT_EQ(tracks.size(), 1U) << "the other thing stays";
  EXPECT_TRUE(equal(tracks[0], {{0, 1}, {1, 1}}));
}

TEST(FeatureTracks, DoNotDependOnTheOrderOfPairsAndMatches) {
  std::vector<ImagePair> pairs{{0, 1, {{0, 0}, {1, 1}}}, {0, 2, {{2, 3}, {0, 1}}}, {1, 2, {{0, 1}, {1, 2}}}};
  const auto expected = tracksOf(pairs, kCounts, 2);
  ASSERT_EQ(expected.size(), 3U);
  std::reverse(pairs.begin(), pairs.end());
  for (ImagePair& pair : pairs) std::reverse(pair.matches.begin(), pair.matches.end());
  const auto tracks = tracksOf(pairs, kCounts, 2);
  ASSERT_EQ(tracks.size(), expected.size());
  for (std::size_t i = 0; i < tracks.size(); ++i) EXPECT_TRUE(equal(tracks[i], expected[i])) << i;
}

TEST(FeatureTracks, HaveAtLeastTheViewsAskedFor) {
  const std::vector<ImagePair> pairs{{0, 1, {{0, 0}, {1, 1}}}, {1, 2, {{0, 1}}}};
  EXPECT_EQ(tracksOf(pairs, kCounts, 2).size(), 2U);
  EXPECT_EQ(tracksOf(pairs, kCounts, 3).size(), 1U);
  EXPECT_EQ(tracksOf(pairs, kCounts, 4).size(), 0U);
}

TEST(FeatureTracks, OfNothingAreNone) {
  EXPECT_TRUE(tracksOf({}, {}, 2).empty());
  EXPECT_TRUE(tracksOf({}, {0, 5, 0}, 2).empty());
}

}  // namespace
}  // namespace visual_localization
