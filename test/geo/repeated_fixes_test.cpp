// Fixes that a driver repeats because its topic is faster than its receiver.
#include <cmath>

#include <gtest/gtest.h>

#include "test/geo/recorded_round.h"

namespace visual_localization {
namespace {

using test::clean;
using test::countOf;
using test::errorsOf;
using test::meanOf;
using test::Path;
using test::record;

/// A car on bends of 100 m radius.
Eigen::Vector2d windingRoad(double time_s) {
  const double along_rad = 15.0 * time_s / 100.0;
  return {100.0 * std::sin(along_rad), 60.0 * (1.0 - std::cos(along_rad)) + 5.0 * time_s};
}

/// Every fix as often as `messages` says, each with its own stamp.
std::vector<Fix> repeated(std::vector<Fix> fixes, std::size_t messages) {
  for (std::size_t i = 0; i < fixes.size(); ++i) fixes[i].position = fixes[i - i % messages].position;
  return fixes;
}

TEST(RepeatedFixes, ADriverFasterThanItsReceiverCostsNothing) {
  constexpr double kDuration_s = 120.0;
  const double slow_m = meanOf(errorsOf(clean(record(windingRoad, kDuration_s, 1.0, 1.0)), windingRoad, kDuration_s));
  const std::vector<Fix> fixes = repeated(record(windingRoad, kDuration_s, 10.0, 1.0), 10);
  const CleanedTrajectory cleaned = clean(fixes);
  EXPECT_EQ(countOf(cleaned, FixVerdict::kRepeated), fixes.size() / 10 * 9);
  EXPECT_LT(meanOf(errorsOf(cleaned, windingRoad, kDuration_s)), 1.3 * slow_m)
      << "8 m where repetitions count as fixes";
}

TEST(RepeatedFixes, OneMessageMoreOrLessIsTheSame) {
  std::vector<Fix> fixes = repeated(record(windingRoad, 120.0, 5.0, 1.0), 5);
  fixes.erase(fixes.begin() + 207);
  fixes.erase(fixes.begin() + 102);
  EXPECT_EQ(countOf(clean(fixes), FixVerdict::kKept), (fixes.size() + 6) / 5);
}

TEST(RepeatedFixes, AReceiverThatHoldsItsPositionWhileItStandsIsBelieved) {
  const auto haltsInBetween = [](double time_s) {
    return windingRoad(time_s < 40.0 ? time_s : std::max(40.0, time_s - 60.0));
  };
  std::vector<Fix> fixes = record(haltsInBetween, 160.0, 5.0, 0.2);
  for (std::size_t i = 200; i < 500; ++i) fixes[i].position = fixes[200].position;
  EXPECT_EQ(countOf(clean(fixes), FixVerdict::kRepeated), 0U) << "it repeats nothing while it moves";
  const std::vector<Fix> slower = repeated(fixes, 5);
  const CleanedTrajectory cleaned = clean(slower);
  EXPECT_EQ(countOf(cleaned, FixVerdict::kKept), (slower.size() + 4) / 5);
  EXPECT_LT(meanOf(errorsOf(cleaned, haltsInBetween, 160.0)), 0.5);
}

TEST(RepeatedFixes, ACoarseReceiverRepeatsNothing) {
  const Path walk = [](double time_s) { return Eigen::Vector2d(0.5 * time_s, 0.3 * time_s); };
  std::vector<Fix> fixes = record(walk, 200.0, 10.0, 0.0);
  for (Fix& fix : fixes) {
    fix.position.latitude_deg = std::round(fix.position.latitude_deg * 1e5) / 1e5;
    fix.position.longitude_deg = std::round(fix.position.longitude_deg * 1e5) / 1e5;
  }
  const CleanedTrajectory cleaned = clean(fixes);
  EXPECT_EQ(countOf(cleaned, FixVerdict::kRepeated), 0U);
  EXPECT_LT(meanOf(errorsOf(cleaned, walk, 200.0)), 0.5) << "half a digit";
}

}  // namespace
}  // namespace visual_localization
