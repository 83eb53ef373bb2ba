#include <gtest/gtest.h>

#include "test/geo/recorded_round.h"
#include "visual_localization/geo/trajectory_cleaner.h"

namespace visual_localization {
namespace {

constexpr double kRound_s = 400.0;

CleanedTrajectory cleanParts(const std::vector<Fix>& fixes) {
  return cleanTrajectory(fixes, LocalFrame(test::kDatum), TrajectoryCleanerConfig());
}

/// The second half so much later.
std::vector<Fix> pausedFor(double pause_s) {
  std::vector<Fix> fixes = test::record(test::block, kRound_s);
  for (std::size_t i = fixes.size() / 2; i < fixes.size(); ++i) {
    fixes[i].stamp_ns += static_cast<std::int64_t>(pause_s * 1e9);
  }
  return fixes;
}

TEST(PausedRecording, AreBothKept) {
  for (const double pause_s : {100.0, 3600.0}) {
    const std::vector<Fix> fixes = pausedFor(pause_s);
    const CleanedTrajectory cleaned = cleanParts(fixes);
    ASSERT_EQ(cleaned.verdicts.size(), fixes.size());
    EXPECT_GT(test::countOf(cleaned, FixVerdict::kKept), fixes.size() * 97 / 100);
    for (const double time_s : {50.0, 150.0, 250.0, 350.0}) {
      const double at_s = time_s + (time_s > 0.5 * kRound_s ? pause_s : 0.0);
      const auto point = cleaned.trajectory.at(test::stampOf(at_s));
      ASSERT_TRUE(point) << time_s;
      EXPECT_LT((point->position_m - test::block(time_s)).norm(), 0.5) << time_s;
    }
    EXPECT_FALSE(cleaned.trajectory.at(test::stampOf(0.5 * kRound_s + 0.5 * pause_s))) << "nothing is known there";
  }
}

TEST(PausedRecording, AreTheWholeWithoutAPause) {
  const std::vector<Fix> fixes = test::record(test::block, kRound_s);
  const CleanedTrajectory parts = cleanParts(fixes);
  const CleanedTrajectory whole = test::clean(fixes);
  EXPECT_EQ(parts.verdicts, whole.verdicts);
  EXPECT_EQ(parts.trajectory.points().size(), whole.trajectory.points().size());
}

TEST(PausedRecording, APathEndsWhereASingleFixFollowsAPause) {
  std::vector<Fix> fixes = test::record(test::block, kRound_s);
  fixes.push_back(fixes.back());
  fixes.back().stamp_ns = test::stampOf(5000.0);
  const CleanedTrajectory cleaned = cleanParts(fixes);
  EXPECT_FALSE(cleaned.trajectory.at(test::stampOf(4000.0)));
  EXPECT_GT(test::countOf(cleaned, FixVerdict::kKept), fixes.size() * 97 / 100);
}

TEST(PausedRecording, AreRefusedWhenNoneIsAPath) {
  std::vector<Fix> fixes = test::record(test::block, 1.0);
  fixes.resize(2);
  fixes[1].stamp_ns += 1'000'000'000'000;
  EXPECT_THROW(cleanParts(fixes), std::runtime_error);
}

}  // namespace
}  // namespace visual_localization
