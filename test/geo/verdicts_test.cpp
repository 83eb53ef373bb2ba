// Which fixes are left out, to the fix: a straight steady drive with faults at known times.

#include <vector>

#include <gtest/gtest.h>

#include "test/geo/recorded_round.h"

namespace visual_localization {
namespace {

using test::countOf;
using test::kDatum;
using test::shift;
using test::timeOf;

constexpr double kSpeed_mps = 2.0;
constexpr double kRate_hz = 10.0;

Eigen::Vector2d straight(double time_s) { return {kSpeed_mps * time_s, 0.0}; }

std::vector<Fix> recorded(double duration_s = 120.0) { return test::record(straight, duration_s, kRate_hz, 0.0); }

TEST(Verdicts, WhatIsWrongForAWhileDoesNotMoveThePathNorTheRestOfTheFixes) {
  std::vector<Fix> fixes = recorded();
  for (Fix& fix : fixes) {
    const double time_s = timeOf(fix);
    if ((time_s > 29.95 && time_s < 36.0) || (time_s > 79.95 && time_s < 86.0)) shift(fix, {0.0, -12.0});
  }
  const CleanedTrajectory cleaned = cleanTrajectory(fixes, LocalFrame(kDatum), {});
  EXPECT_LT(test::largestOf(test::errorsOf(cleaned, straight, 120.0)), 0.2);
  for (std::size_t i = 0; i < fixes.size(); ++i) {
    const double time_s = timeOf(fixes[i]);
    const bool is_beside = (time_s > 28.9 && time_s < 37.1) || (time_s > 78.9 && time_s < 87.1);
    if (!is_beside) {
      EXPECT_EQ(cleaned.verdicts[i], FixVerdict::kKept) << time_s;
    }
  }
}

// A fix every two metres: each is a node of its own.
TEST(Verdicts, OneFixAloneIsASpikeAndTwoAreMultipath) {
  for (const std::size_t bad : {1U, 2U, 4U}) {
    std::vector<Fix> fixes = test::record(straight, 100.0, 1.0, 0.0);
    ASSERT_EQ(fixes.size(), 100U);
    for (std::size_t i = 50; i < 50 + bad; ++i) shift(fixes[i], {0.0, 40.0});
    const CleanedTrajectory cleaned = cleanTrajectory(fixes, LocalFrame(kDatum), {});
    const FixVerdict expected = bad == 1 ? FixVerdict::kSpike : FixVerdict::kMultipath;
    for (std::size_t i = 0; i < fixes.size(); ++i) {
      EXPECT_EQ(cleaned.verdicts[i], i >= 50 && i < 50 + bad ? expected : FixVerdict::kKept) << bad << ": " << i;
    }
  }
}

TEST(Verdicts, WrongFixesAtAnEndDoNotMoveThePath) {
  for (const std::size_t bad : {1U, 2U, 4U}) {
    for (const std::size_t first : {std::size_t{0}, std::size_t{100} - bad}) {
      std::vector<Fix> fixes = test::record(straight, 100.0, 1.0, 0.0);
      for (std::size_t i = first; i < first + bad; ++i) shift(fixes[i], {0.0, 40.0});
      const CleanedTrajectory cleaned = cleanTrajectory(fixes, LocalFrame(kDatum), {});
      EXPECT_LT(test::largestOf(test::errorsOf(cleaned, straight, 100.0)), 0.3) << bad << " from " << first;
    }
  }
}

TEST(Verdicts, GapsAreCountedFromFiveMissedFixesOn) {
  for (const std::size_t missed : {4U, 5U, 30U}) {
    std::vector<Fix> fixes = recorded();
    for (std::size_t i = 300; i < 300 + missed; ++i) fixes[i].has_fix = false;
    const CleanedTrajectory cleaned = cleanTrajectory(fixes, LocalFrame(kDatum), {});
    EXPECT_EQ(cleaned.gaps_closed, missed >= 5 ? 1U : 0U) << missed;
    EXPECT_NEAR(cleaned.longest_gap_s, missed >= 5 ? (static_cast<double>(missed) + 1.0) / kRate_hz : 0.0, 1e-6);
    EXPECT_EQ(countOf(cleaned, FixVerdict::kNoFix), missed);
  }
}

TEST(Verdicts, OfAPathTheFirstGapCountsToo) {
  std::vector<Fix> fixes = recorded();
  for (std::size_t i = 1; i < 30; ++i) fixes[i].has_fix = false;
  const CleanedTrajectory cleaned = cleanTrajectory(fixes, LocalFrame(kDatum), {});
  EXPECT_EQ(cleaned.gaps_closed, 1U);
  EXPECT_NEAR(cleaned.longest_gap_s, 3.0, 1e-6);
}

TEST(Verdicts, TwoFixesAreAPath) {
  std::vector<Fix> fixes = recorded();
  fixes.resize(2);
  EXPECT_EQ(countOf(cleanTrajectory(fixes, LocalFrame(kDatum), {}), FixVerdict::kKept), 2U);
}

TEST(Verdicts, TheHeadingOfARobotThatStandsIsTheOneItCameWith) {
  const auto stop = [](double time_s) -> Eigen::Vector2d {
    return time_s < 30.0   ? Eigen::Vector2d(2.0 * time_s, 0.0)
           : time_s < 60.0 ? Eigen::Vector2d(60.0, 0.0)
                           : Eigen::Vector2d(60.0, 2.0 * (time_s - 60.0));
  };
  const std::vector<Fix> fixes = test::record(stop, 90.0, kRate_hz, 0.0);
  const CleanedTrajectory cleaned = cleanTrajectory(fixes, LocalFrame(kDatum), {});
  const auto yawAt = [&](double time_s) { return cleaned.trajectory.at(test::stampOf(time_s))->yaw_rad; };
  EXPECT_NEAR(yawAt(1.0), 0.0, 0.02);
  EXPECT_NEAR(yawAt(20.0), 0.0, 0.02);
  EXPECT_NEAR(yawAt(75.0), kPi / 2.0, 0.02);
  const auto early = [](double time_s) -> Eigen::Vector2d {
    return time_s < 30.0 ? Eigen::Vector2d(0.0, 0.0) : Eigen::Vector2d(0.0, 2.0 * (time_s - 30.0));
  };
  const CleanedTrajectory begun = cleanTrajectory(test::record(early, 90.0, kRate_hz, 0.0), LocalFrame(kDatum), {});
  EXPECT_NEAR(begun.trajectory.at(test::stampOf(2.0))->yaw_rad, kPi / 2.0, 0.05)
      << "before it moves, the one that it will have";
}

}  // namespace
}  // namespace visual_localization
