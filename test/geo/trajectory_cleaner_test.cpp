#include "visual_localization/geo/trajectory_cleaner.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "test/geo/recorded_round.h"

namespace visual_localization {
namespace {

using test::block;
using test::clean;
using test::countOf;
using test::errorsOf;
using test::kRate;
using test::largestOf;
using test::meanOf;
using test::Path;
using test::record;
using test::shift;
using test::stampOf;
using test::timeOf;

TEST(TrajectoryCleaner, ACleanRoundLosesNothing) {
  const std::vector<Fix> fixes = record(block, 250.0);
  const CleanedTrajectory cleaned = clean(fixes);
  ASSERT_EQ(cleaned.verdicts.size(), fixes.size());
  EXPECT_EQ(countOf(cleaned, FixVerdict::kKept), fixes.size());
  const auto errors_m = errorsOf(cleaned, block, 250.0);
  EXPECT_EQ(errors_m.size(), 249u);
  EXPECT_LT(meanOf(errors_m), 0.1);
  EXPECT_LT(largestOf(errors_m), 0.4);
  EXPECT_EQ(cleaned.gaps_closed, 0u);
}

TEST(TrajectoryCleaner, HeadingIsTheDirectionOfTravel) {
  const CleanedTrajectory cleaned = clean(record(block, 250.0));
  for (const double time_s : {20.0, 100.0, 150.0}) {
    const Eigen::Vector2d ahead = block(time_s + 0.5) - block(time_s - 0.5);
    const auto point = cleaned.trajectory.at(stampOf(time_s));
    ASSERT_TRUE(point);
    EXPECT_LT(std::abs(angleDifference(std::atan2(ahead.y(), ahead.x()), point->yaw_rad)), 0.15);
  }
}

/// Counter-clockwise on a circle of 20 m radius.
Eigen::Vector2d onRound(double along_m) {
  return 20.0 * Eigen::Vector2d(std::cos(along_m / 20.0), std::sin(along_m / 20.0));
}

TEST(TrajectoryCleaner, HeadingIsTheDirectionOfTheWayRoundABend) {
  const CleanedTrajectory cleaned = clean(record([](double time_s) { return onRound(2.0 * time_s); }, 40.0, 10.0, 0.0));
  const std::vector<TrajectoryPoint>& points = cleaned.trajectory.points();
  ASSERT_GT(points.size(), 50U);
  for (std::size_t k = 0; k < points.size(); ++k) {
    const std::size_t behind = std::min(k + 1, points.size() - 1);  // at the ends from or to the point itself
    const Eigen::Vector2d way_m = points[behind].position_m - points[k == 0 ? 0 : k - 1].position_m;
    EXPECT_NEAR(angleDifference(std::atan2(way_m.y(), way_m.x()), points[k].yaw_rad), 0.0, 0.02) << k;
  }
}

TEST(TrajectoryCleaner, WhereTheRobotStandsItKeepsOneHeading) {
  const Path stopping = [](double time_s) { return onRound(2.0 * std::min(time_s, 30.0)); };
  const CleanedTrajectory cleaned = clean(record(stopping, 60.0, 10.0, 0.0));
  const double yaw_rad = cleaned.trajectory.at(stampOf(45.0))->yaw_rad;
  EXPECT_NEAR(angleDifference(60.0 / 20.0 + 0.5 * kPi, yaw_rad), 0.0, 0.2) << "the one it came with";
  for (const TrajectoryPoint& point : cleaned.trajectory.points()) {
    if (point.stamp_ns > stampOf(40.0)) {
      EXPECT_EQ(point.yaw_rad, yaw_rad);
    }
  }
}

TEST(TrajectoryCleaner, ATenthOfTheSpeedIsStanding) {
  for (const double crawl_mps : {0.1, 0.3}) {  // of 2 m/s, north, and then east
    const Path path = [crawl_mps](double time_s) {
      return Eigen::Vector2d(crawl_mps * std::max(0.0, time_s - 60.0), 2.0 * std::min(time_s, 60.0));
    };
    const CleanedTrajectory cleaned = clean(record(path, 90.0, 10.0, 0.0));
    const auto point = cleaned.trajectory.at(stampOf(80.0));
    ASSERT_TRUE(point);
    EXPECT_NEAR(point->yaw_rad, crawl_mps < 0.2 ? 0.5 * kPi : 0.0, 0.4) << crawl_mps;
  }
}

TEST(TrajectoryCleaner, WhoNeverMovesLooksEast) {
  const CleanedTrajectory cleaned = clean(record([](double) { return Eigen::Vector2d(3.0, 4.0); }, 60.0, kRate, 0.0));
  for (const TrajectoryPoint& point : cleaned.trajectory.points()) ASSERT_EQ(point.yaw_rad, 0.0);
}

TEST(TrajectoryCleaner, DropsSpikesAndInvalidFixes) {
  std::vector<Fix> fixes = record(block, 250.0);
  const std::vector<std::size_t> spikes{100, 333, 707, 1100};
  for (const std::size_t i : spikes) shift(fixes[i], {i % 2 == 0 ? 20.0 : -45.0, 0.0});
  for (std::size_t i = 500; i < 540; ++i) {
    fixes[i].has_fix = false;
    fixes[i].position.latitude_deg = std::nan("");
  }
  fixes[900].position.longitude_deg = std::numeric_limits<double>::infinity();
  fixes[901].position.latitude_deg = 91.0;
  const CleanedTrajectory cleaned = clean(fixes);
  for (const std::size_t i : spikes) EXPECT_EQ(cleaned.verdicts[i], FixVerdict::kSpike) << i;
  EXPECT_EQ(countOf(cleaned, FixVerdict::kSpike), spikes.size());
  EXPECT_EQ(countOf(cleaned, FixVerdict::kNoFix), 42u);
  EXPECT_EQ(cleaned.gaps_closed, 1u);
  EXPECT_NEAR(cleaned.longest_gap_s, 8.2, 0.3);
  EXPECT_LT(largestOf(errorsOf(cleaned, block, 250.0)), 0.6);
}

// Exact fixes in pairs, of a robot at 5 m/s: their second differences are the intervals, not noise.
TEST(TrajectoryCleaner, UnevenIntervalsAreNoNoise) {
  std::vector<Fix> fixes;
  const LocalFrame frame(test::kDatum);
  for (int i = 0; i < 400; ++i) {
    const double time_s = 0.2 * i + (i % 2 == 0 ? 0.0 : -0.15);
    fixes.push_back({stampOf(time_s), frame.toGeodetic(Eigen::Vector2d::Constant(3.5 * time_s)), true});
  }
  for (std::size_t i = 200; i < 208; ++i) shift(fixes[i], {1.5, -1.5});
  const CleanedTrajectory cleaned = clean(fixes);
  for (std::size_t i = 200; i < 208; ++i) EXPECT_EQ(cleaned.verdicts[i], FixVerdict::kMultipath) << i;
}

TEST(TrajectoryCleaner, WhatIsWrongAtTheStartDoesNotMoveThePath) {
  std::vector<Fix> fixes = record(block, 100.0, kRate, 0.01);
  for (std::size_t i = 0; i < 20; ++i) shift(fixes[i], {0.0, 12.0});
  EXPECT_LT(largestOf(errorsOf(clean(fixes), block, 100.0)), 0.2);
}

TEST(TrajectoryCleaner, DropsMultipathBendsInAnyDirection) {
  for (int direction = 0; direction < 8; ++direction) {
    const double angle_rad = direction * kPi / 4.0;
    std::vector<Fix> fixes = record(block, 250.0);
    for (Fix& fix : fixes) {
      const double offset_s = (timeOf(fix) - 35.0) / 4.0;  // on a straight stretch, 16 s long, 8 m wide
      shift(fix,
            8.0 * std::exp(-0.5 * offset_s * offset_s) * Eigen::Vector2d(std::cos(angle_rad), std::sin(angle_rad)));
    }
    const CleanedTrajectory cleaned = clean(fixes);
    const auto errors_m = errorsOf(cleaned, block, 250.0);
    EXPECT_LT(meanOf(errors_m), 0.25) << "direction " << direction;
    EXPECT_LT(largestOf(errors_m), 2.0) << "direction " << direction;
    EXPECT_GT(countOf(cleaned, FixVerdict::kMultipath), 30u);
    EXPECT_LT(countOf(cleaned, FixVerdict::kMultipath), 250u);
  }
}

TEST(TrajectoryCleaner, ClosesGapsAlsoAroundACorner) {
  std::vector<Fix> fixes = record(block, 250.0);
  fixes.erase(std::remove_if(fixes.begin(), fixes.end(),
                             [](const Fix& fix) {
                               const double time_s = timeOf(fix);
                               return (time_s > 20.0 && time_s < 40.0) || (time_s > 78.0 && time_s < 92.0);
                             }),
              fixes.end());
  const CleanedTrajectory cleaned = clean(fixes);
  EXPECT_EQ(cleaned.gaps_closed, 2u);
  EXPECT_NEAR(cleaned.longest_gap_s, 20.0, 0.5);
  const auto errors_m = errorsOf(cleaned, block, 250.0);
  EXPECT_EQ(errors_m.size(), 249u);
  EXPECT_LT(largestOf(errors_m), 1.5);
}

TEST(TrajectoryCleaner, LeavesLongGapsOpen) {
  std::vector<Fix> fixes = record(block, 400.0);
  fixes.erase(fixes.begin() + 500, fixes.begin() + 1200);
  const CleanedTrajectory cleaned = clean(fixes);
  EXPECT_FALSE(cleaned.trajectory.at(fixes[500].stamp_ns - 50000000000));
  EXPECT_TRUE(cleaned.trajectory.at(fixes[600].stamp_ns));
}

TEST(TrajectoryCleaner, ARobotMayStandStill) {
  const Path stopping = [](double time_s) { return block(time_s < 50.0 ? time_s : std::max(50.0, time_s - 60.0)); };
  const CleanedTrajectory cleaned = clean(record(stopping, 250.0));
  EXPECT_LT(countOf(cleaned, FixVerdict::kMultipath), 60u);
  EXPECT_LT(meanOf(errorsOf(cleaned, stopping, 250.0)), 0.2);
  for (const TrajectoryPoint& point : cleaned.trajectory.points()) ASSERT_TRUE(std::isfinite(point.yaw_rad));
}

TEST(TrajectoryCleaner, ARobotMayBeParkedForMostOfTheRecording) {
  const Path parking = [](double time_s) { return block(time_s < 60.0 ? time_s : std::max(60.0, time_s - 3000.0)); };
  const CleanedTrajectory cleaned = clean(record(parking, 3120.0, kRate, 0.05));
  EXPECT_LT(countOf(cleaned, FixVerdict::kMultipath), 60u);
  EXPECT_LT(largestOf(errorsOf(cleaned, parking, 3120.0)), 0.6);
}

TEST(TrajectoryCleaner, SparseExactFixesPassUnharmed) {
  const Path line = [](double time_s) { return Eigen::Vector2d(0.5 * time_s, 0.0); };
  const std::vector<Fix> fixes = record(line, 200.0, 0.25, 0.0);
  const CleanedTrajectory cleaned = clean(fixes);
  EXPECT_EQ(countOf(cleaned, FixVerdict::kKept), fixes.size());
  EXPECT_LT(largestOf(errorsOf(cleaned, line, 195.0)), 0.05);
}

TEST(TrajectoryCleaner, AVeryShortRoundIsARound) {
  const Path line = [](double time_s) { return Eigen::Vector2d(0.7 * time_s, 0.0); };
  for (const double duration_s : {0.5, 2.0, 8.0}) {
    for (const double noise_m : {0.0, 0.1}) {
      const std::vector<Fix> fixes = record(line, duration_s, 5.0, noise_m);
      EXPECT_GE(2 * countOf(clean(fixes), FixVerdict::kKept), fixes.size()) << duration_s << " s";
    }
  }
}

TEST(TrajectoryCleaner, AFastCarPassesUnharmed) {
  const Path road = [](double time_s) { return Eigen::Vector2d(12.0 * time_s, 20.0 * std::sin(time_s / 5.0)); };
  const std::vector<Fix> fixes = record(road, 30.0, 5.0, 0.02);
  const CleanedTrajectory cleaned = clean(fixes);
  EXPECT_EQ(countOf(cleaned, FixVerdict::kKept), fixes.size());
  EXPECT_LT(largestOf(errorsOf(cleaned, road, 30.0)), 0.3);
}

TEST(TrajectoryCleaner, DoesNotDependOnTheTimeOfDay) {
  std::vector<Fix> fixes = record(block, 120.0);
  shift(fixes[200], {30.0, 0.0});
  const CleanedTrajectory first = clean(fixes);
  for (Fix& fix : fixes) fix.stamp_ns += 86400000000000;
  const CleanedTrajectory second = clean(fixes);
  EXPECT_EQ(first.verdicts, second.verdicts);
  ASSERT_EQ(first.trajectory.points().size(), second.trajectory.points().size());
  for (std::size_t i = 0; i < first.trajectory.points().size(); ++i) {
    EXPECT_EQ(first.trajectory.points()[i].position_m, second.trajectory.points()[i].position_m);
  }
}

}  // namespace
}  // namespace visual_localization
