#include "localization/place_probabilities.h"

#include <algorithm>
#include <numeric>
#include <random>
#include <vector>

#include <gtest/gtest.h>

namespace visual_localization {
namespace {

double totalOf(const PlaceProbabilities& places) {
  return places.sum([](const auto& place) { return place.probability; });
}

/// Some of their own, some of these equal to each other and to what is common.
PlaceProbabilities someOf(std::size_t count, std::size_t own, std::uint32_t seed) {
  std::mt19937 random(seed);
  PlaceProbabilities places(count);
  places.reset(2.0);
  for (std::size_t i = 0; i < own; ++i) places.own(random() % count).probability = static_cast<double>(random() % 5);
  const double sum = totalOf(places);
  places.forEach([sum](auto& place) { place.probability /= sum; });
  return places;
}

std::vector<double> denseOf(const PlaceProbabilities& places) {
  std::vector<double> dense(places.size());
  for (std::size_t i = 0; i < dense.size(); ++i) dense[i] = places[i];
  return dense;
}

TEST(PlaceProbabilities, TheSumIsThatOfAll) {
  for (const std::size_t own : {0U, 3U, 40U, 1000U}) {
    const PlaceProbabilities places = someOf(50, own, 1);
    const std::vector<double> dense = denseOf(places);
    EXPECT_NEAR(totalOf(places), 1.0, 1e-12) << own;
    EXPECT_NEAR(std::accumulate(dense.begin(), dense.end(), 0.0), 1.0, 1e-12) << own;
  }
}

TEST(PlaceProbabilities, TheMostProbableAreThoseOfAll) {
  for (const std::size_t own : {0U, 3U, 40U, 1000U}) {
    const PlaceProbabilities places = someOf(50, own, 2);
    std::vector<std::size_t> order(50);
    std::iota(order.begin(), order.end(), 0);
    std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return places[a] > places[b]; });
    for (const std::size_t count : {0U, 1U, 7U, 49U, 50U, 70U}) {
      std::vector<std::size_t> found{1, 2, 3};
      places.mostProbable(count, 0.0, found);
      std::vector<std::size_t> expected(order.begin(),
                                        order.begin() + static_cast<std::ptrdiff_t>(std::min(count, order.size())));
      std::sort(found.begin(), found.end());
      std::sort(expected.begin(), expected.end());
      EXPECT_EQ(found, expected) << own << ", " << count;
    }
    std::vector<std::size_t> found;
    const double least = places[order[10]];
    places.mostProbable(50, least, found);
    EXPECT_EQ(static_cast<std::ptrdiff_t>(found.size()),
              std::count_if(order.begin(), order.end(), [&](std::size_t i) { return places[i] >= least; }));
  }
}

TEST(PlaceProbabilities, QuantilesAreThoseOfAll) {
  for (const std::size_t own : {0U, 3U, 40U, 1000U}) {
    const PlaceProbabilities places = someOf(50, own, 3);
    constexpr std::size_t kCount = 333;
    const std::vector<std::size_t> found = places.quantiles(0.0007, 1.0 / kCount, kCount);
    ASSERT_EQ(found.size(), kCount);
    double cumulated = 0.0;
    std::size_t image = 0;
    for (std::size_t i = 0; i < kCount; ++i) {
      const double target = 0.0007 + static_cast<double>(i) / kCount;
      while (cumulated + places[image] <= target) cumulated += places[image++];
      EXPECT_EQ(found[i], image) << own << ", " << i;
    }
  }
}

TEST(PlaceProbabilities, WhatIsAlikeIsJoined) {
  PlaceProbabilities places(100);
  places.reset(0.01);
  places.own(7).probability = 0.02;
  places.own(8).probability = 0.0;
  places.own(9);
  places.joinAlike();
  EXPECT_EQ(places.allOwn().size(), 2U);
  EXPECT_TRUE(places.isCommon(9));
  EXPECT_DOUBLE_EQ(places[7], 0.02);
  EXPECT_DOUBLE_EQ(places[8], 0.0);
  EXPECT_DOUBLE_EQ(places[9], 0.01);
  EXPECT_NEAR(totalOf(places), 1.0, 1e-12);
}

TEST(PlaceProbabilities, NothingIsJoinedWhereNothingIsCommon) {
  PlaceProbabilities places(3);
  places.reset(0.5);
  places.own(0).probability = 0.2;
  places.own(1).probability = 0.3;
  places.own(2);
  places.joinAlike();
  EXPECT_EQ(places.allOwn().size(), 3U);
  EXPECT_DOUBLE_EQ(totalOf(places), 1.0);
  EXPECT_DOUBLE_EQ(places[2], 0.5);
}

TEST(PlaceProbabilities, OfTooManyTheMostProbableStay) {
  constexpr std::size_t kCount = 3 * PlaceProbabilities::kMostOwn;
  PlaceProbabilities places(kCount);
  places.reset(1.0);
  for (std::size_t i = 0; i < 2 * PlaceProbabilities::kMostOwn; ++i) {
    places.own(kCount - 1 - i).probability = i % 2 == 0 ? 3.0 + static_cast<double>(i) : 0.5;
  }
  const double sum = totalOf(places);
  places.joinAlike();
  EXPECT_EQ(places.allOwn().size(), PlaceProbabilities::kMostOwn);
  EXPECT_NEAR(totalOf(places), sum, 1e-9 * sum);
  for (std::size_t i = 0; i < 2 * PlaceProbabilities::kMostOwn; ++i) {
    if (i % 2 == 0)
      EXPECT_DOUBLE_EQ(places[kCount - 1 - i], 3.0 + static_cast<double>(i));
    else
      EXPECT_TRUE(places.isCommon(kCount - 1 - i));
  }
}

}  // namespace
}  // namespace visual_localization
