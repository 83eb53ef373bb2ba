// Robots and receivers of all kinds: the path is never worse than the raw fixes, and good fixes are believed.

#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "test/geo/robots.h"

namespace visual_localization {
namespace {

using test::car;
using test::clean;
using test::countOf;
using test::errorsOf;
using test::kDatum;
using test::kDrive_s;
using test::kReceivers;
using test::largestOf;
using test::meanOf;
using test::mower;
using test::Path;
using test::rawError_m;
using test::Receiver;
using test::recordedBy;
using test::stampOf;
using test::timeOf;
using test::walker;

TEST(Receivers, NoneIsWorseThanItsFixesAndGoodFixesAreBelieved) {
  constexpr double kNotWorse = 1.05;
  constexpr double kRounding_m = 0.01;
  const std::vector<std::pair<std::string, Path>> robots{{"car", car()}, {"mower", mower()}, {"walker", walker()}};
  for (const auto& [robot, path] : robots) {
    for (const Receiver& receiver : kReceivers) {
      SCOPED_TRACE(robot + ", " + receiver.name);
      const std::vector<Fix> fixes = recordedBy(path, receiver);
      const CleanedTrajectory cleaned = clean(fixes);
      EXPECT_LE(meanOf(errorsOf(cleaned, path, kDrive_s)), kNotWorse * rawError_m(fixes, path) + kRounding_m);
      EXPECT_GE(countOf(cleaned, FixVerdict::kKept), fixes.size() * 95 / 100);
    }
  }
}

/// Fixes of a receiver that is aside for 70 of `period_s`, from `begin_s` on, and declares 0.5 m meanwhile.
std::vector<Fix> floatAndFixed(const Path& path, double begin_s, double period_s) {
  std::vector<Fix> fixes = recordedBy(path, kReceivers[3]);
  for (Fix& fix : fixes) {
    const double time_s = std::fmod(timeOf(fix), period_s);
    if (time_s < begin_s || time_s > begin_s + 70.0) continue;
    test::shift(fix, {1.2, timeOf(fix) < 300.0 ? -0.5 : 0.8});
    fix.sigma_m = 0.5;
  }
  return fixes;
}

TEST(Receivers, StepsBetweenFloatAndFixedDoNotMoveThePath) {
  const Path path = mower();
  const std::vector<Fix> fixes = floatAndFixed(path, 60.0, 200.0);
  const CleanedTrajectory cleaned = clean(fixes);
  EXPECT_LT(meanOf(errorsOf(cleaned, path, kDrive_s)), 0.2);
  EXPECT_GE(countOf(cleaned, FixVerdict::kKept), fixes.size() * 95 / 100);
}

TEST(Receivers, StepsOfAReceiverThatAlwaysDeclaresTheSameDoNotMoveThePath) {
  const Path path = mower();
  for (const double declared_m : {0.0, 30.0}) {
    for (const double begin_s : {75.5, 90.1}) {  // and ends: while it drives
      SCOPED_TRACE(std::to_string(declared_m) + " m, from " + std::to_string(begin_s) + " s on");
      std::vector<Fix> fixes = floatAndFixed(path, begin_s, 240.0);
      for (Fix& fix : fixes) fix.sigma_m = declared_m;
      const CleanedTrajectory cleaned = clean(fixes);
      EXPECT_LT(meanOf(errorsOf(cleaned, path, kDrive_s)), 0.1);
      EXPECT_GE(countOf(cleaned, FixVerdict::kKept), fixes.size() * 95 / 100);
    }
  }
}

TEST(Receivers, AJumpOfACarsReceiverDoesNotMoveThePath) {
  const Path path = car();
  std::vector<Fix> fixes = recordedBy(path, {"exact", 5.0, 0.05, 0.0, 1.0, 0.7});
  for (Fix& fix : fixes) {
    if (timeOf(fix) > 35.0 && timeOf(fix) < 41.0) test::shift(fix, {4.0, -5.0});
  }
  EXPECT_LT(largestOf(errorsOf(clean(fixes), path, kDrive_s)), 1.5);
}

TEST(Receivers, AbsurdFixesAreOutliersLikeOthers) {
  const Path path = walker();
  std::vector<Fix> fixes = recordedBy(path, kReceivers[1]);
  const double raw_m = rawError_m(fixes, path);
  for (const std::size_t i : {0U, 1U, 700U, 701U, 702U}) test::shift(fixes[i], {3e5, -2e5});
  fixes[1400].position.latitude_deg = -fixes[1400].position.latitude_deg;  // on the other side of the earth
  fixes[1401].position.longitude_deg -= 180.0;
  const CleanedTrajectory cleaned = clean(fixes);
  EXPECT_LE(meanOf(errorsOf(cleaned, path, kDrive_s)), 1.1 * raw_m);
  EXPECT_EQ(cleaned.verdicts[1400], FixVerdict::kSpike);
  EXPECT_EQ(cleaned.verdicts[1401], FixVerdict::kSpike);
  for (const std::size_t i : {700U, 701U, 702U}) EXPECT_NE(cleaned.verdicts[i], FixVerdict::kKept) << i;
}

TEST(Receivers, TheWanderOfAReceiverThatStandsStaysAsItIs) {
  const Path standing = [](double) { return Eigen::Vector2d(5.0, 5.0); };
  const std::vector<Fix> fixes = recordedBy(standing, kReceivers[1]);
  const CleanedTrajectory cleaned = clean(fixes);
  EXPECT_LE(meanOf(errorsOf(cleaned, standing, kDrive_s)), 1.05 * rawError_m(fixes, standing));
  EXPECT_GE(countOf(cleaned, FixVerdict::kKept), fixes.size() * 95 / 100);
  EXPECT_LT(cleaned.trajectory.length(), 120.0) << "0.2 m/s";
}

TEST(Receivers, APausedRecordingKeepsBothParts) {
  for (const double pause_s : {100.0, 3600.0}) {
    const Path path = walker();
    std::vector<Fix> fixes = recordedBy(path, kReceivers[1]);
    for (Fix& fix : fixes) {
      if (timeOf(fix) > 300.0) fix.stamp_ns += static_cast<std::int64_t>(pause_s * 1e9);
    }
    const CleanedTrajectory cleaned = clean(fixes);
    EXPECT_GE(countOf(cleaned, FixVerdict::kKept), fixes.size() * 98 / 100) << pause_s;
    EXPECT_TRUE(cleaned.trajectory.at(stampOf(200.0)));
    EXPECT_TRUE(cleaned.trajectory.at(stampOf(400.0 + pause_s)));
    EXPECT_FALSE(cleaned.trajectory.at(stampOf(300.0 + 0.5 * pause_s)));
  }
}

TEST(Receivers, WhoSaysThatTheSpeedIsConstantGetsWhatThatImplies) {
  const Path line = [](double time_s) { return Eigen::Vector2d(time_s, 0.0); };
  std::vector<Fix> fixes = test::record(line, 200.0, 5.0, 0.05);
  for (Fix& fix : fixes) {
    const double away_s = (timeOf(fix) - 100.0) / 6.0;
    test::shift(fix, {0.0, 8.0 * std::exp(-0.5 * away_s * away_s)});
  }
  TrajectoryCleanerConfig strict;
  strict.speed_tolerance = 0.03;
  TrajectoryCleanerConfig lenient;
  lenient.speed_tolerance = 1.0;
  const LocalFrame frame(kDatum);
  EXPECT_LT(largestOf(errorsOf(cleanTrajectory(fixes, frame, strict), line, 200.0)), 3.0);
  EXPECT_GT(largestOf(errorsOf(cleanTrajectory(fixes, frame, lenient), line, 200.0)), 5.0);
}

TEST(Receivers, AnHourAtTenHertzTakesSeconds) {
  const Path path = walker();
  std::vector<Fix> fixes = recordedBy(path, kReceivers[0]);
  const std::size_t count = fixes.size();
  for (int again = 1; again < 6; ++again) {
    for (std::size_t i = 0; i < count; ++i) {
      fixes.push_back(fixes[i]);
      fixes.back().stamp_ns += static_cast<std::int64_t>(again * kDrive_s * 1e9);
      test::shift(fixes.back(), again * (path(kDrive_s) - path(0.0)));
    }
  }
  const CpuStopwatch watch;
  const CleanedTrajectory cleaned = clean(fixes);
  EXPECT_LT(watch.elapsed_ms(), 60e3) << "also under sanitizers";
  EXPECT_GE(countOf(cleaned, FixVerdict::kKept), fixes.size() * 95 / 100);
}

}  // namespace
}  // namespace visual_localization
