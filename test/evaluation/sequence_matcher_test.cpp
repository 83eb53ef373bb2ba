#include <algorithm>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "evaluation/place_recogniser.h"
#include "test/evaluation/place_rows.h"

namespace visual_localization {
namespace {

/// Images 15 and 55 of 80 cannot be told apart.
std::vector<double> aliasedRow(std::size_t at) {
  std::vector<double> row = test::rowAt(at, 80, false);
  if (at == 55) row[15] = 0.6;  // the wrong one even looks better
  return row;
}

TEST(SequenceMatcher, TellsTwinPlacesApartThatOneImageCannot) {
  SequenceMatcher matcher({}, false);
  BestSingleImage single;
  Recognition by_sequence;
  Recognition by_image;
  for (std::size_t at = 46; at <= 55; ++at) {
    by_sequence = matcher.update(aliasedRow(at));
    by_image = single.update(aliasedRow(at));
  }
  EXPECT_EQ(by_image.training_image, 15u);
  EXPECT_EQ(by_sequence.training_image, 55u);
}

TEST(SequenceMatcher, FollowsAClosedRouteOverItsEnd) {
  SequenceMatcher closed({}, true);
  SequenceMatcher open({}, false);
  const Recognition wrapped = test::drive(closed, 35, 10, 40, true);
  const Recognition broken = test::drive(open, 35, 10, 40, true);
  EXPECT_EQ(wrapped.training_image, 4u);
  EXPECT_GT(wrapped.confidence, broken.confidence + 0.1);  // the line before the end of the route is lost
}

TEST(SequenceMatcher, OnlySpeedsInItsRangeMakeALine) {
  SequenceConfig fast;
  fast.min_speed = 2.0;
  fast.max_speed = 2.0;
  SequenceMatcher right(fast, false);
  SequenceMatcher wrong({}, false);
  double right_confidence = 0.0;
  double wrong_confidence = 0.0;
  for (std::size_t at = 20; at < 40; at += 2) {
    const std::vector<double> row = test::rowAt(at, 80, false);
    const Recognition answer = right.update(row);
    EXPECT_EQ(answer.training_image, at);
    right_confidence = answer.confidence;
    wrong_confidence = wrong.update(row).confidence;
  }
  EXPECT_GT(right_confidence, wrong_confidence + 0.2);
}

TEST(SequenceMatcher, TriesTheFastestSpeedToo) {
  SequenceConfig config;
  config.min_speed = 0.8;
  config.max_speed = 1.2;  // 0.8 + 4 * 0.1 is a little more
  SequenceConfig only_fast = config;
  only_fast.min_speed = 1.2;
  SequenceMatcher both(config, false);
  SequenceMatcher fast(only_fast, false);
  Recognition by_both;
  Recognition by_fast;
  for (int step = 0; step < 10; ++step) {
    const auto row = test::rowAt(static_cast<std::size_t>(std::lround(20.0 + 1.2 * step)), 80, false);
    by_both = both.update(row);
    by_fast = fast.update(row);
  }
  EXPECT_EQ(by_both.training_image, by_fast.training_image);
  EXPECT_NEAR(by_both.confidence, by_fast.confidence, 0.05);
}

TEST(SequenceMatcher, BrightnessOfAStretchOfTheMapDoesNotMatter) {
  SequenceMatcher matcher({}, false);
  Recognition answer;
  for (std::size_t at = 20; at < 30; ++at) {
    std::vector<double> row = test::rowAt(at, 200, false);
    for (double& similarity : row) similarity *= 0.6;
    for (std::size_t image = 100; image < 200; ++image) row[image] += 0.4;  // alike to everything
    EXPECT_GT(*std::max_element(row.begin() + 100, row.end()), row[at]);
    answer = matcher.update(row);
  }
  EXPECT_EQ(answer.training_image, 29u);
}

TEST(SequenceMatcher, ChanceSimilaritiesAmongZerosAreNoContrast) {
  std::vector<double> row = test::rowAt(20, 80, false);
  row[60] = 0.02;  // all alone: no value could stand out more, were it not for the least contrast
  SequenceMatcher matcher({}, false);
  EXPECT_EQ(matcher.update(row).training_image, 20u);
}

TEST(SequenceMatcher, ForgetsAllButTheLastImages) {
  SequenceConfig config;
  config.length = 6;
  SequenceMatcher used(config, false);
  SequenceMatcher fresh(config, false);
  test::drive(used, 60, 9, 80, false);
  const Recognition after_jump = test::drive(used, 10, 6, 80, false);
  const Recognition expected = test::drive(fresh, 10, 6, 80, false);
  EXPECT_EQ(after_jump.training_image, 15u);
  EXPECT_EQ(after_jump.confidence, expected.confidence);
}

}  // namespace
}  // namespace visual_localization
