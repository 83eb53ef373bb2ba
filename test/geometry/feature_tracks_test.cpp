#include "geometry/feature_tracks.h"

#include <algorithm>
#include <limits>

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

FeatureSets setsOf(const std::vector<ImagePair>& pairs, const std::vector<std::size_t>& feature_counts) {
  FeatureSets sets;
  for (const std::size_t count : feature_counts) sets.addImage(count);
  for (const ImagePair& pair : pairs) sets.join(pair);
  return sets;
}

std::vector<FeatureTrack> tracksOf(const std::vector<ImagePair>& pairs, const std::vector<std::size_t>& feature_counts,
                                   std::size_t min_views) {
  return setsOf(pairs, feature_counts).tracks(min_views);
}

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

TEST(FeatureTracks, StayAsTheyAreBehindThoseOfOtherImages) {
  FeatureSets sets = setsOf({{0, 1, {{0, 1}}}}, kCounts);
  sets.append(setsOf({{0, 2, {{1, 3}}}}, kCounts));
  const auto apart = sets.tracks(2);
  ASSERT_EQ(apart.size(), 2U);
  EXPECT_TRUE(equal(apart[0], {{0, 0}, {1, 1}}));
  EXPECT_TRUE(equal(apart[1], {{3, 1}, {5, 3}}));
  sets.join({1, 3, {{1, 1}}});
  const auto tied = sets.tracks(2);
  ASSERT_EQ(tied.size(), 1U);
  EXPECT_TRUE(equal(tied[0], {{0, 0}, {1, 1}, {3, 1}, {5, 3}}));
}

std::size_t oneSession(std::uint32_t) { return 0; }

TEST(FeatureTracks, AreCutIntoPiecesOfAboutTheSameLength) {
  FeatureTrack track;
  for (std::uint32_t image = 0; image < 11; ++image) track.push_back({image, 7});
  const auto cut = cutTrack(track, 4, oneSession);
  ASSERT_EQ(cut.size(), 3U);
  std::vector<FeatureObservation> joined;
  for (const FeatureTrack& piece : cut) {
    EXPECT_GE(piece.size(), 3U);
    EXPECT_LE(piece.size(), 4U);
    joined.insert(joined.end(), piece.begin(), piece.end());
  }
  EXPECT_TRUE(equal(joined, track));
}

TEST(FeatureTracks, StayWholeBelowTheLimit) {
  const FeatureTrack track{{0, 1}, {1, 2}, {4, 3}};
  for (const std::size_t most : {std::size_t{3}, std::numeric_limits<std::size_t>::max()}) {
    const auto cut = cutTrack(track, most, oneSession);
    ASSERT_EQ(cut.size(), 1U);
    EXPECT_TRUE(equal(cut[0], track));
  }
  EXPECT_TRUE(cutTrack({}, 3, oneSession).empty());
}

TEST(FeatureTracks, AreCutWithTheImagesOfAllSessionsTogether) {
  FeatureTrack track;
  for (std::uint32_t image = 0; image < 12; ++image) track.push_back({image, 1});
  const auto cut = cutTrack(track, 4, [](std::uint32_t image) { return image < 8 ? 0 : 1; });
  ASSERT_EQ(cut.size(), 2U);
  EXPECT_TRUE(equal(cut[0], {{0, 1}, {1, 1}, {2, 1}, {3, 1}, {8, 1}, {9, 1}}));
  EXPECT_TRUE(equal(cut[1], {{4, 1}, {5, 1}, {6, 1}, {7, 1}, {10, 1}, {11, 1}}));
}

}  // namespace
}  // namespace visual_localization
