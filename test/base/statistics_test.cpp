#include <algorithm>
#include <random>

#include <gtest/gtest.h>

#include "base/numbers.h"

namespace visual_localization {
namespace {

TEST(Median, IsTheMiddleOrTheMeanOfTheTwoInTheMiddle) {
  EXPECT_EQ(median({}), 0.0);
  EXPECT_EQ(median({7.0}), 7.0);
  EXPECT_EQ(median({9.0, 1.0, 4.0}), 4.0);
  EXPECT_EQ(median({9.0, 1.0, 4.0, 2.0}), 3.0);
}

TEST(UpperMedian, IsOneOfTheValuesAndOfTwoInTheMiddleTheLarger) {
  std::vector<double> even{9.0, 1.0, 4.0, 2.0};
  EXPECT_EQ(upperMedian(even), 4.0);
  std::vector<float> odd{9.0F, 1.0F, 4.0F};
  EXPECT_EQ(upperMedian(odd), 4.0F);
}

TEST(NearestRank, IsTheSmallestValueThatTheShareIsNotAbove) {
  std::vector<double> values;
  for (int i = 20; i >= 1; --i) values.push_back(i);
  EXPECT_EQ(nearestRank(values, 0.0), 1.0);
  EXPECT_EQ(nearestRank(values, 0.5), 10.0);
  EXPECT_EQ(nearestRank(values, 0.95), 19.0);
  EXPECT_EQ(nearestRank(values, 0.951), 20.0);
  EXPECT_EQ(nearestRank(values, 1.0), 20.0);
}

TEST(NearestRank, CountsFromTheLargestAsWell) {
  // 95 % are not longer than the one that a twentieth of all, rounded down, are before when the longest come first.
  std::vector<double> values;
  for (std::size_t count = 1; count <= 3000; ++count) {
    values.push_back(static_cast<double>(count));
    EXPECT_EQ(nearestRank(values, 0.95), static_cast<double>(count - count / 20)) << count;
    EXPECT_EQ(nearestRank(values, 0.5), static_cast<double>(count - count / 2)) << count;
  }
}

TEST(Quantile, IsLinearBetweenTheSortedValues) {
  const std::vector<double> sorted{0.0, 1.0, 4.0};
  EXPECT_EQ(quantile(sorted, 0.0), 0.0);
  EXPECT_EQ(quantile(sorted, 0.5), 1.0);
  EXPECT_EQ(quantile(sorted, 0.75), 2.5);
  EXPECT_EQ(quantile(sorted, 1.0), 4.0);
  EXPECT_EQ(quantile({3.0}, 0.3), 3.0);
}

TEST(Statistics, DoNotDependOnTheOrder) {
  std::mt19937 random(3);
  std::vector<double> values{5.0, 1.5, 1.5, -2.0, 8.0, 0.25, 3.0, 3.5};
  for (int i = 0; i < 50; ++i) {
    std::shuffle(values.begin(), values.end(), random);
    EXPECT_EQ(median(values), 2.25);
    EXPECT_EQ(upperMedian(values), 3.0);
    EXPECT_EQ(nearestRank(values, 0.5), 1.5);
  }
}

}  // namespace
}  // namespace visual_localization
