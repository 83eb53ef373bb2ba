#include "features/nearest_descriptors.h"

#include <cmath>
#include <iterator>
#include <limits>
#include <random>
#include <utility>

#include <gtest/gtest.h>

#include "test/support/cpu_targets.h"
#include "test/support/synthetic.h"
#include "visual_localization/features/sift.h"

namespace visual_localization {
namespace {

LocalFeatures withDescriptors(const std::vector<std::vector<std::uint8_t>>& descriptors) {
  return test::featuresOf(descriptors);
}

/// The same anywhere in an image of 300 rows, and some where a map may claim to have them.
LocalFeatures placed(const LocalFeatures& features, std::mt19937& random) {
  std::uniform_real_distribution<float> row(0.0F, 300.0F);
  std::vector<Keypoint> keypoints(features.size());
  for (std::size_t i = 0; i < keypoints.size(); ++i) keypoints[i] = {0.0F, row(random), 1.0F, 0.0F};
  constexpr float kInfinite = std::numeric_limits<float>::infinity();
  const float claimed[] = {std::numeric_limits<float>::quiet_NaN(), kInfinite, -kInfinite, -5.0F, 1e30F};
  for (std::size_t i = 0; i < keypoints.size(); i += 7) keypoints[i].y_px = claimed[i / 7 % std::size(claimed)];
  return LocalFeatures(keypoints, features.bytes());
}

/// Bins up to `largest`, and every `duplicate_every`-th descriptor equal to the one before.
LocalFeatures randomDescriptors(std::size_t count, int largest, std::size_t duplicate_every, std::mt19937& random) {
  std::uniform_int_distribution<int> bin(0, largest);
  std::vector<std::vector<std::uint8_t>> descriptors(count, std::vector<std::uint8_t>(kSiftDimension));
  for (std::size_t i = 0; i < count; ++i) {
    for (std::uint8_t& value : descriptors[i]) value = static_cast<std::uint8_t>(bin(random));
    if (i % duplicate_every == duplicate_every - 1) descriptors[i] = descriptors[i - 1];
  }
  return withDescriptors(descriptors);
}

void expectEqual(const std::vector<TwoNearest>& actual, const std::vector<TwoNearest>& expected) {
  ASSERT_EQ(actual.size(), expected.size());
  for (std::size_t i = 0; i < actual.size(); ++i) {
    ASSERT_EQ(actual[i].index, expected[i].index) << i;
    ASSERT_EQ(actual[i].best, expected[i].best) << i;
    ASSERT_EQ(actual[i].second, expected[i].second) << i;
  }
}

void expectWithinLikePlain(const LocalFeatures& a, const LocalFeatures& b, float max_dy_px) {
  NearestDescriptors fast;
  NearestDescriptors plain;
  findNearestWithin(a, b, max_dy_px, fast);
  findNearestWithinPlain(a, b, max_dy_px, plain);
  SCOPED_TRACE(std::to_string(a.size()) + " x " + std::to_string(b.size()) + " within " + std::to_string(max_dy_px));
  for (std::size_t i = 0; i < a.size(); ++i) EXPECT_EQ(plain.of_a[i].second, -1.0F);
  expectEqual(fast.of_a, plain.of_a);
  expectEqual(fast.of_b, plain.of_b);
}

void expectLikePlain(const LocalFeatures& a, const LocalFeatures& b) {
  NearestDescriptors fast;
  NearestDescriptors plain;
  findNearest(a, b, fast);
  findNearestPlain(a, b, plain);
  SCOPED_TRACE(std::to_string(a.size()) + " x " + std::to_string(b.size()));
  expectEqual(fast.of_a, plain.of_a);
  expectEqual(fast.of_b, plain.of_b);
}

TEST(NearestDescriptors, AreThoseOfThePlainLoopForEverySize) {
  std::mt19937 random(1);
  for (const std::size_t a : {1, 2, 3, 4, 7, 8, 15, 16, 17, 31, 33, 64, 100}) {
    for (const std::size_t b : {1, 2, 3, 5, 16, 18, 101}) {
      expectLikePlain(randomDescriptors(a, 255, 5, random), randomDescriptors(b, 255, 5, random));
    }
  }
}

TEST(NearestDescriptors, AreThoseOfThePlainLoopAmongManyEquals) {
  std::mt19937 random(2);
  for (int round = 0; round < 20; ++round) {
    const LocalFeatures a = randomDescriptors(40, 1, 2, random);
    expectLikePlain(a, randomDescriptors(50, 1, 3, random));
    expectLikePlain(a, a);
  }
}

TEST(NearestDescriptors, ExtremesDoNotOverflow) {
  const std::vector<std::uint8_t> zero(kSiftDimension, 0);
  const std::vector<std::uint8_t> full(kSiftDimension, 255);
  std::vector<std::uint8_t> half = zero;
  std::fill_n(half.begin(), 64, std::uint8_t{255});
  const LocalFeatures all = withDescriptors({zero, full, half, zero, full});
  expectLikePlain(all, all);
  expectLikePlain(withDescriptors({zero, zero, zero}), all);
  expectLikePlain(all, withDescriptors({zero, zero}));
  NearestDescriptors nearest;
  findNearest(all, all, nearest);
  EXPECT_FLOAT_EQ(nearest.of_a[1].best, 1.0F);
  EXPECT_FLOAT_EQ(nearest.of_a[2].second, std::sqrt(0.5F));
  EXPECT_EQ(nearest.of_a[4].index, 1U) << "the first of equals";
  EXPECT_EQ(nearest.of_a[0].best, 0.0F) << "the zero vector is orthogonal to everything";
}

TEST(NearestDescriptors, WithinRowsAreThoseOfThePlainLoopOnEveryCpu) {
  test::forEachTarget([] {
    std::mt19937 random(4);
    for (const std::size_t a : {1, 3, 16, 17, 33, 100, 250}) {
      for (const std::size_t b : {1, 5, 16, 101}) {
        const LocalFeatures here = placed(randomDescriptors(a, 255, 5, random), random);
        const LocalFeatures there = placed(randomDescriptors(b, 5, 3, random), random);
        for (const float max_dy_px : {0.0F, 40.0F, 1e9F}) expectWithinLikePlain(here, there, max_dy_px);
      }
    }
  });
}

TEST(NearestDescriptors, WithinRowsNothingOverflowsOnAnyCpu) {
  test::forEachTarget([] {
    std::vector<std::uint8_t> few(kSiftDimension, 0);
    std::fill_n(few.begin(), 5, std::uint8_t{255});
    std::vector<std::vector<std::uint8_t>> descriptors{std::vector<std::uint8_t>(kSiftDimension, 0), few};
    // Squared norms of the halves of every other pair just below and above 2^16, where 16 bits end.
    for (const int bin : {62, 63, 64, 66, 90, 255}) {
      descriptors.emplace_back(kSiftDimension, static_cast<std::uint8_t>(bin));
      descriptors.back()[3] = 0;
    }
    const LocalFeatures all = withDescriptors(descriptors);
    expectWithinLikePlain(all, all, 1.0F);
    for (const std::vector<std::uint8_t>& one : descriptors) {
      expectWithinLikePlain(withDescriptors({one}), all, 1.0F);
      expectWithinLikePlain(withDescriptors({one}), withDescriptors({one}), 1.0F);
    }
  });
}

TEST(NearestDescriptors, HalvedSiftFitsInto16Bits) {
  for (const bool hellinger : {false, true}) {
    SiftConfig config;
    config.hellinger = hellinger;
    const LocalFeatures features = makeSiftExtractor(config)->extract(test::wall(320, 240, 5));
    ASSERT_GT(features.size(), 100U);
    for (std::size_t i = 0; i < features.size(); ++i) {
      int squared[2] = {0, 0};
      for (std::size_t k = 0; k < kSiftDimension; ++k) {
        squared[k / 2 % 2] += (features.bytes(i)[k] / 2) * (features.bytes(i)[k] / 2);
      }
      EXPECT_LT(std::max(squared[0], squared[1]), 1 << 16) << i;
    }
  }
}

TEST(NearestDescriptors, WithinRowsLookNoFarther) {
  const std::vector<std::uint8_t> same(kSiftDimension, 3);
  std::vector<std::uint8_t> other = same;
  other[0] = 90;
  const LocalFeatures a({{0.0F, 100.0F, 1.0F, 0.0F}}, std::vector<std::uint8_t>(same));
  std::vector<std::uint8_t> both = same;
  both.insert(both.end(), other.begin(), other.end());
  const LocalFeatures b({{0.0F, 141.0F, 1.0F, 0.0F}, {0.0F, 60.0F, 1.0F, 0.0F}}, std::move(both));
  NearestDescriptors nearest;
  findNearestWithin(a, b, 40.0F, nearest);
  EXPECT_EQ(nearest.of_a[0].index, 1U);
  EXPECT_EQ(nearest.of_b[0].best, -1.0F);
  findNearestWithin(a, b, 41.0F, nearest);
  EXPECT_EQ(nearest.of_a[0].index, 0U);
}

TEST(NearestDescriptors, TheFirstImageMayStayOrChangeOnEveryCpu) {
  test::forEachTarget([] {
    std::mt19937 random(5);
    LocalFeatures a = placed(randomDescriptors(90, 60, 5, random), random);
    for (const std::size_t count : {70, 33, 110}) {
      for (int i = 0; i < 3; ++i) {
        const LocalFeatures b = placed(randomDescriptors(90, 60, 5, random), random);
        expectWithinLikePlain(a, b, 40.0F);
        expectLikePlain(a, b);
        expectWithinLikePlain(LocalFeatures(a), a, 40.0F);
      }
      Keypoints keypoints = placed(randomDescriptors(count, 60, 5, random), random).keypoints();
      std::vector<std::uint8_t> descriptors = randomDescriptors(count, 60, 5, random).bytes();
      a.swapIn(keypoints, descriptors);  // in the same memory
    }
    const LocalFeatures moved = std::move(a);
    expectWithinLikePlain(a, moved, 40.0F);  // NOLINT(bugprone-use-after-move): it is empty
    expectWithinLikePlain(moved, a, 40.0F);
  });
}

TEST(NearestDescriptors, NothingHasNoNeighbours) {
  NearestDescriptors nearest;
  findNearest({}, withDescriptors({std::vector<std::uint8_t>(kSiftDimension, 1)}), nearest);
  EXPECT_TRUE(nearest.of_a.empty());
  ASSERT_EQ(nearest.of_b.size(), 1U);
  EXPECT_EQ(nearest.of_b[0].best, -1.0F);
  findNearestWithin({}, withDescriptors({std::vector<std::uint8_t>(kSiftDimension, 1)}), 9.0F, nearest);
  EXPECT_EQ(nearest.of_b[0].best, -1.0F);
  findNearestWithin(withDescriptors({std::vector<std::uint8_t>(kSiftDimension, 1)}), {}, 9.0F, nearest);
  EXPECT_EQ(nearest.of_a[0].best, -1.0F);
}

TEST(AngleRatioTest, DecidesLikeTheAnglesThemselves) {
  std::mt19937 random(3);
  std::uniform_real_distribution<float> cosine(0.0F, 1.0F);
  for (const double ratio : {0.1, 0.6, 0.8, 1.0}) {
    const AngleRatioTest test(ratio);
    for (int i = 0; i < 200000; ++i) {
      const float second = cosine(random);
      // Half of the pairs lie at the threshold, where rounding decides.
      const auto threshold = static_cast<float>(std::cos(ratio * std::acos(static_cast<double>(second))));
      const float best =
          i % 2 == 0 ? cosine(random) : std::min(1.0F, std::nextafter(threshold, i % 4 == 1 ? 2.0F : 0.0F));
      const bool expected = std::acos(static_cast<double>(best)) < ratio * std::acos(static_cast<double>(second));
      ASSERT_EQ(test.passes(best, second), expected) << ratio << ' ' << best << ' ' << second;
    }
  }
}

TEST(AngleRatioTest, HoldsAtTheEnds) {
  const AngleRatioTest test(0.6);
  EXPECT_FALSE(test.passes(1.0F, 1.0F)) << "twins";
  EXPECT_TRUE(test.passes(1.0F, 0.999F));
  EXPECT_FALSE(test.passes(0.0F, 0.0F));
  EXPECT_TRUE(test.passes(std::nextafter(1.0F, 2.0F), 0.5F)) << "a cosine above one by rounding";
  EXPECT_FALSE(test.passes(std::nextafter(1.0F, 2.0F), std::nextafter(1.0F, 2.0F)));
}

}  // namespace
}  // namespace visual_localization
