#include <limits>

#include <gtest/gtest.h>

#include "map/feature_store.h"

namespace visual_localization {
namespace {

constexpr std::size_t kEach = 1000;
constexpr std::size_t kTaken = kEach + FeatureCache<int>::kBookkeeping_bytes;

/// The numbers from 0 to `count`, each as large as any other.
FeatureCache<int> filled(std::size_t limit_bytes, int count) {
  FeatureCache<int> cache(limit_bytes);
  for (int i = 0; i < count; ++i) cache.add(static_cast<std::uint64_t>(i), std::make_shared<const int>(i), kEach);
  return cache;
}

TEST(FeatureCache, KeepsWhatFits) {
  FeatureCache<int> cache = filled(3 * kTaken, 3);
  for (int i = 0; i < 3; ++i) EXPECT_EQ(*cache.find(static_cast<std::uint64_t>(i)), i);
  EXPECT_EQ(cache.find(3), nullptr);
  EXPECT_EQ(cache.used_bytes(), 3 * kTaken);
}

TEST(FeatureCache, ForgetsWhatWasUsedLongestAgo) {
  FeatureCache<int> cache = filled(3 * kTaken, 3);
  cache.find(0);
  cache.add(3, std::make_shared<const int>(3), kEach);
  EXPECT_EQ(cache.find(1), nullptr);
  EXPECT_NE(cache.find(0), nullptr);
  EXPECT_NE(cache.find(2), nullptr);
  EXPECT_NE(cache.find(3), nullptr);
}

TEST(FeatureCache, NeverExceedsItsBytes) {
  FeatureCache<int> cache(10 * kTaken + 1);
  for (std::uint64_t i = 0; i < 1000; ++i) {
    cache.add(i, std::make_shared<const int>(0), 10 + 37 * i % 3000);
    EXPECT_LE(cache.used_bytes(), 10 * kTaken + 1);
  }
  EXPECT_GT(cache.size(), 3U);
}

TEST(FeatureCache, WhatIsInUseStaysAlive) {
  FeatureCache<int> cache = filled(kTaken, 1);
  const auto used = cache.find(0);
  cache.add(1, std::make_shared<const int>(1), kEach);
  EXPECT_EQ(cache.find(0), nullptr);
  EXPECT_EQ(*used, 0);
}

TEST(FeatureCache, ALimitOfNothingKeepsNothing) {
  EXPECT_EQ(filled(0, 5).size(), 0U);
  EXPECT_EQ(filled(1, 5).size(), 0U);
  EXPECT_EQ(filled(kTaken - 1, 5).size(), 0U);
}

TEST(FeatureCache, AHugeLimitKeepsEverything) {
  EXPECT_EQ(filled(std::numeric_limits<std::size_t>::max(), 100).size(), 100U);
}

TEST(FeatureCache, KeepsTheFirstOfOneKey) {
  FeatureCache<int> cache = filled(5 * kTaken, 1);
  cache.add(0, std::make_shared<const int>(7), kEach);
  EXPECT_EQ(*cache.find(0), 0);
  EXPECT_EQ(cache.used_bytes(), kTaken);
}

}  // namespace
}  // namespace visual_localization
