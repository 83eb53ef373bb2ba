#include <cmath>
#include <limits>
#include <stdexcept>

#include <gtest/gtest.h>

#include "evaluation/metrics.h"

namespace visual_localization {
namespace {

TEST(RecallAtPrecision, KnownAnswers) {
  const std::vector<Decision> decisions = {{0.1, true}, {0.9, true}, {0.5, false}, {0.8, true}, {0.2, true}};
  EXPECT_DOUBLE_EQ(recallAtPrecision(decisions, 1.0), 0.4);   // 0.9 and 0.8
  EXPECT_DOUBLE_EQ(recallAtPrecision(decisions, 0.81), 0.4);  // all five are only 4 / 5
  EXPECT_DOUBLE_EQ(recallAtPrecision(decisions, 0.8), 0.8);
  EXPECT_DOUBLE_EQ(recallAtPrecision(decisions, 0.0), 0.8);
}

TEST(RecallAtPrecision, LowerThresholdMayMakeUpForAnEarlyMistake) {
  EXPECT_DOUBLE_EQ(recallAtPrecision({{0.9, false}, {0.8, true}, {0.7, true}, {0.6, true}}, 0.75), 0.75);
}

TEST(RecallAtPrecision, EqualConfidencesAreAcceptedTogetherInAnyOrder) {
  EXPECT_DOUBLE_EQ(recallAtPrecision({{0.5, true}, {0.5, false}}, 1.0), 0.0);
  EXPECT_DOUBLE_EQ(recallAtPrecision({{0.5, false}, {0.5, true}}, 1.0), 0.0);
  EXPECT_DOUBLE_EQ(recallAtPrecision({{0.5, true}, {0.5, false}}, 0.5), 0.5);
  EXPECT_DOUBLE_EQ(recallAtPrecision({{0.5, true}, {0.5, false}, {0.7, true}, {0.7, true}}, 1.0), 0.5);
}

TEST(RecallAtPrecision, SharesAreComparedExactly) {
  std::vector<Decision> decisions(100, Decision{0.5, true});
  decisions[7].correct = false;
  EXPECT_DOUBLE_EQ(recallAtPrecision(decisions, 0.99), 0.99);
  decisions[8].correct = false;
  EXPECT_DOUBLE_EQ(recallAtPrecision(decisions, 0.99), 0.0);
}

TEST(RecallAtPrecision, NothingAcceptableIsZero) {
  EXPECT_DOUBLE_EQ(recallAtPrecision({}, 0.5), 0.0);
  EXPECT_DOUBLE_EQ(recallAtPrecision({{0.5, false}}, 0.0), 0.0);
  EXPECT_DOUBLE_EQ(recallAtPrecision({{0.9, false}, {0.5, true}}, 0.6), 0.0);
}

TEST(RecallAtPrecision, RefusesWhatCannotBeOrdered) {
  EXPECT_THROW(recallAtPrecision({}, 1.1), std::invalid_argument);
  EXPECT_THROW(recallAtPrecision({}, -0.1), std::invalid_argument);
  EXPECT_THROW(recallAtPrecision({}, std::nan("")), std::invalid_argument);
  EXPECT_THROW(recallAtPrecision({{std::nan(""), true}}, 0.5), std::invalid_argument);
  EXPECT_DOUBLE_EQ(recallAtPrecision({{std::numeric_limits<double>::infinity(), true}}, 1.0), 1.0);
}

}  // namespace
}  // namespace visual_localization
