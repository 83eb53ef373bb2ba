#include "visual_localization/features/feature_matcher.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include <gtest/gtest.h>

#include "base/numbers.h"
#include "test/support/synthetic.h"
#include "visual_localization/features/sift.h"

namespace visual_localization {
namespace {

using test::descriptor;
using test::featuresOf;
using test::randomFeatures;

/// A descriptor at `degrees` from the first axis, in the plane of the first two.
std::vector<std::uint8_t> atAngle(double degrees) {
  const double rad = degrees * kPi / 180.0;
  return descriptor(
      {static_cast<int>(std::lround(255.0 * std::cos(rad))), static_cast<int>(std::lround(255.0 * std::sin(rad)))});
}

bool contains(const std::vector<FeatureMatch>& matches, std::size_t a, std::size_t b) {
  return std::any_of(matches.begin(), matches.end(), [&](const FeatureMatch& m) { return m.a == a && m.b == b; });
}

TEST(SiftMatcher, OrthogonalDescriptorsMatchThemselves) {
  const LocalFeatures features = featuresOf({descriptor({200}), descriptor({0, 200}), descriptor({0, 0, 200})});
  const auto matches = matchSymmetric(features, features, 0.6);
  ASSERT_EQ(matches.size(), 3u);
  for (std::size_t i = 0; i < 3; ++i) EXPECT_TRUE(contains(matches, i, i));
}

TEST(SiftMatcher, TheRatioOfTheAnglesDecides) {
  // From 0 degrees the nearest is at 12 and the second at 24: a ratio of 0.5.
  const LocalFeatures a = featuresOf({atAngle(0.0), descriptor({0, 0, 255})});
  const LocalFeatures b = featuresOf({atAngle(12.0), atAngle(24.0)});
  EXPECT_TRUE(contains(matchOneWay(a, b, 0.52), 0, 0));
  EXPECT_FALSE(contains(matchOneWay(a, b, 0.48), 0, 0));
}

TEST(SiftMatcher, LengthDoesNotMatterOnlyDirectionDoes) {
  const LocalFeatures a = featuresOf({descriptor({250, 50}), descriptor({0, 0, 100})});
  const LocalFeatures b = featuresOf({descriptor({0, 0, 255}), descriptor({50, 10})});
  const auto matches = matchSymmetric(a, b, 0.6);
  EXPECT_TRUE(contains(matches, 0, 1));
  EXPECT_TRUE(contains(matches, 1, 0));
}

TEST(SiftMatcher, DuplicatesAreNotDistinct) {
  const LocalFeatures a = featuresOf({descriptor({200}), descriptor({0, 200})});
  const LocalFeatures b = featuresOf({descriptor({200}), descriptor({200}), descriptor({0, 200})});
  const auto matches = matchOneWay(a, b, 0.6);
  ASSERT_EQ(matches.size(), 1u);
  EXPECT_TRUE(contains(matches, 1, 2));
}

TEST(SiftMatcher, OneWayAcceptsWhatSymmetricRefuses) {
  // Both features of A are nearest to b0; only the nearer of them is its nearest.
  const LocalFeatures a = featuresOf({atAngle(2.0), atAngle(8.0)});
  const LocalFeatures b = featuresOf({atAngle(0.0), descriptor({0, 0, 255})});
  EXPECT_EQ(matchOneWay(a, b, 0.6).size(), 2u);
  const auto symmetric = matchSymmetric(a, b, 0.6);
  ASSERT_EQ(symmetric.size(), 1u);
  EXPECT_TRUE(contains(symmetric, 0, 0));
}

TEST(SiftMatcher, FewerThanTwoFeaturesNeverMatch) {
  const LocalFeatures none;
  const LocalFeatures one = featuresOf({descriptor({200})});
  const LocalFeatures two = featuresOf({descriptor({200}), descriptor({0, 200})});
  for (const auto* a : {&none, &one}) {
    EXPECT_TRUE(matchOneWay(*a, two, 0.6).empty());
    EXPECT_TRUE(matchOneWay(two, *a, 0.6).empty());
    EXPECT_TRUE(matchSymmetric(*a, two, 0.6).empty());
    EXPECT_TRUE(matchSymmetric(two, *a, 0.6).empty());
  }
}

TEST(SiftMatcher, ZeroDescriptorsMatchNothing) {
  const LocalFeatures zeros = featuresOf({descriptor({}), descriptor({})});
  const LocalFeatures others = featuresOf({descriptor({200}), descriptor({0, 200})});
  EXPECT_TRUE(matchOneWay(zeros, others, 0.99).empty());
  EXPECT_TRUE(matchSymmetric(zeros, zeros, 0.99).empty());
}

/// A noisy copy of some of the features, so that there is something to match.
LocalFeatures disturbed(const LocalFeatures& features, std::size_t count) {
  std::vector<std::vector<std::uint8_t>> descriptors;
  for (std::size_t i = 0; i < count; ++i) {
    std::vector<std::uint8_t> bytes(features.bytes(i), features.bytes(i) + kSiftDimension);
    for (std::size_t k = i % 5; k < bytes.size(); k += 5) bytes[k] = static_cast<std::uint8_t>(bytes[k] ^ 0x1F);
    descriptors.push_back(bytes);
  }
  return featuresOf(descriptors);
}

TEST(SiftMatcher, SymmetricMatchesDoNotDependOnTheOrderOfTheImages) {
  const LocalFeatures a = randomFeatures(57, 1);
  const LocalFeatures b = disturbed(a, 40);
  const auto forward = matchSymmetric(a, b, 0.8);
  const auto backward = matchSymmetric(b, a, 0.8);
  EXPECT_GT(forward.size(), 20u);
  ASSERT_EQ(forward.size(), backward.size());
  for (const FeatureMatch& match : forward) EXPECT_TRUE(contains(backward, match.b, match.a));
}

TEST(SiftMatcher, SymmetricIsTheIntersectionOfBothDirections) {
  const LocalFeatures a = randomFeatures(31, 3);
  const LocalFeatures b = disturbed(a, 25);
  const auto a_to_b = matchOneWay(a, b, 0.8);
  const auto b_to_a = matchOneWay(b, a, 0.8);
  std::size_t expected = 0;
  for (const FeatureMatch& match : a_to_b) expected += contains(b_to_a, match.b, match.a) ? 1 : 0;
  EXPECT_EQ(matchSymmetric(a, b, 0.8).size(), expected);
}

/// One keypoint of each size.
LocalFeatures ofSizes(const std::vector<float>& sizes_px) {
  std::vector<Keypoint> keypoints;
  for (const float size_px : sizes_px) keypoints.push_back({0.0F, 0.0F, size_px, 0.0F});
  return {keypoints, std::vector<std::uint8_t>(sizes_px.size() * kSiftDimension)};
}

TEST(SiftMatcher, MedianScaleIsThatOfTheMatchedFeatures) {
  const LocalFeatures near = ofSizes({6.0F, 100.0F, 9.0F, 5.0F});
  const LocalFeatures far = ofSizes({3.0F, 3.0F, 3.0F, 1.0F});
  const std::vector<FeatureMatch> matches{{0, 0}, {2, 1}, {3, 2}};  // 2, 3 and 5/3; the large one has no partner
  EXPECT_FLOAT_EQ(static_cast<float>(medianScale(near, far, matches)), 2.0F);
  EXPECT_FLOAT_EQ(static_cast<float>(medianScale(far, near, {{0, 0}, {1, 2}, {2, 3}})), 0.5F);
  EXPECT_EQ(medianScale(near, far, {}), 1.0);
}

TEST(SiftMatcher, MedianScaleLeavesOutSizesThatAreNone) {
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  const LocalFeatures live = ofSizes({4.0F, 4.0F, 4.0F, 4.0F, 4.0F});
  const LocalFeatures hostile = ofSizes({0.0F, -1.0F, kNan, kInfinity, 8.0F});
  EXPECT_EQ(medianScale(live, hostile, {{0, 0}, {1, 1}, {2, 2}, {3, 3}, {4, 4}}), 0.5);
  EXPECT_EQ(medianScale(live, hostile, {{0, 0}, {1, 1}, {2, 2}, {3, 3}}), 1.0);
}

TEST(Pruning, KeepsWhatAtLeastOneNeighbourShows) {
  const auto x = descriptor({200});
  const auto y = descriptor({0, 200});
  const auto z = descriptor({0, 0, 200});
  const auto other = descriptor({0, 0, 0, 200});
  const LocalFeatures features = featuresOf({x, y, z});
  const LocalFeatures left = featuresOf({x, other});
  const LocalFeatures right = featuresOf({other, z});
  const LocalFeatures kept = keepSeenIn(features, {&left, &right}, 0.6);
  ASSERT_EQ(kept.size(), 2u);
  EXPECT_EQ(kept.keypoints()[0].x_px, 0.0F);
  EXPECT_EQ(kept.keypoints()[1].x_px, 2.0F);
  EXPECT_TRUE(std::equal(z.begin(), z.end(), kept.bytes(1)));
}

TEST(Pruning, WithoutNeighboursNothingIsConfirmed) {
  const LocalFeatures features = randomFeatures(5, 7);
  EXPECT_TRUE(keepSeenIn(features, {}, 0.6).empty());
}

TEST(LocalFeatures, RefusesDescriptorsThatDoNotFit) {
  EXPECT_THROW(LocalFeatures({{}, {}, {}}, std::vector<std::uint8_t>(128)), std::invalid_argument);
}

}  // namespace
}  // namespace visual_localization
