#include "geometry/ransac.h"

#include <map>
#include <random>
#include <set>

#include <gtest/gtest.h>

namespace visual_localization {
namespace {

// 10 samples of two of five, each of them as often as the others: 1000 +- 30 times, of which six sigmas are 180.
TEST(Ransac, DrawsEachSampleAsOften) {
  std::minstd_rand random;
  std::map<std::set<std::size_t>, int> times;
  for (int i = 0; i < 10000; ++i) {
    const auto [first, second] = drawDistinct<2>(5, random);
    ++times[{first, second}];
  }
  EXPECT_EQ(times.size(), 10U) << "of two different ones below five";
  for (const auto& [sample, count] : times) {
    EXPECT_EQ(sample.size(), 2U);
    EXPECT_LT(*sample.rbegin(), 5U);
    EXPECT_NEAR(count, 1000, 180);
  }
}

TEST(Ransac, DrawsAllOfAsManyAsItNeeds) {
  std::minstd_rand random;
  for (int i = 0; i < 100; ++i) {
    const auto drawn = drawDistinct<3>(3, random);
    EXPECT_EQ(std::set<std::size_t>(drawn.begin(), drawn.end()), (std::set<std::size_t>{0, 1, 2}));
  }
}

// Hartley and Zisserman 2004, table 4.3, is for 99 %; for 99.9 % it is half as many again: log 0.001 / log(1 - w^s).
TEST(Ransac, TakesAsManySamplesAsTheOutliersAsk) {
  EXPECT_EQ(samplesNeeded(0.5, 3, 1, 1000), 52);
  EXPECT_EQ(samplesNeeded(0.7, 5, 1, 1000), 38);
  EXPECT_EQ(samplesNeeded(0.5, 5, 1, 1000), 218);
}

TEST(Ransac, StaysWithinItsLimits) {
  EXPECT_EQ(samplesNeeded(1.0, 5, 10, 1000), 10);
  EXPECT_EQ(samplesNeeded(0.99, 3, 30, 200), 30);
  EXPECT_EQ(samplesNeeded(0.1, 5, 10, 1000), 1000);
  EXPECT_EQ(samplesNeeded(0.0, 5, 10, 1000), 1000);
}

}  // namespace
}  // namespace visual_localization
