// Fixes that no receiver should give: few or many points, one clear refusal, never nonsense.
#include <algorithm>
#include <limits>
#include <random>
#include <stdexcept>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "test/geo/recorded_round.h"
#include "test/support/refusal.h"

namespace visual_localization {
namespace {

using test::block;
using test::clean;
using test::countOf;
using test::errorsOf;
using test::largestOf;
using test::Path;
using test::record;

TEST(TrajectoryCleaner, StampsThatStandStillOrGoBackAreDropped) {
  std::vector<Fix> fixes = record(block, 60.0);
  fixes[100].stamp_ns = fixes[99].stamp_ns;
  fixes[200].stamp_ns = fixes[10].stamp_ns;
  const CleanedTrajectory cleaned = clean(fixes);
  EXPECT_EQ(cleaned.verdicts[100], FixVerdict::kDisordered);
  EXPECT_EQ(cleaned.verdicts[200], FixVerdict::kDisordered);
  EXPECT_EQ(countOf(cleaned, FixVerdict::kDisordered), 2u);
}

TEST(TrajectoryCleaner, AStampFarAheadDoesNotCostWhatFollows) {
  std::vector<Fix> fixes = record(block, 60.0);
  fixes[100].stamp_ns += 3'600'000'000'000;
  const CleanedTrajectory cleaned = clean(fixes);
  EXPECT_EQ(cleaned.verdicts[100], FixVerdict::kDisordered);
  EXPECT_EQ(countOf(cleaned, FixVerdict::kKept), fixes.size() - 1);
}

TEST(TrajectoryCleaner, FixesInReverseOrderAreRefusedForThat) {
  std::vector<Fix> fixes = record(block, 60.0);
  std::reverse(fixes.begin(), fixes.end());
  EXPECT_THAT(test::refusalOf<std::runtime_error>([&] { clean(fixes); }),
              testing::HasSubstr("299 of 300 are out of order"));
}

TEST(TrajectoryCleaner, FixesFasterThanFiftyHertzAreThinned) {
  std::vector<Fix> fixes = record(block, 60.0, 100.0);
  const CleanedTrajectory cleaned = clean(fixes);
  EXPECT_EQ(countOf(cleaned, FixVerdict::kTooFast), fixes.size() / 2);
  EXPECT_EQ(countOf(cleaned, FixVerdict::kKept), (fixes.size() + 1) / 2);
  EXPECT_LT(largestOf(errorsOf(cleaned, block, 60.0)), 0.3);
  fixes = record(block, 60.0, 50.0);
  for (std::size_t i = 0; i < fixes.size(); ++i) fixes[i].stamp_ns += i % 2 == 0 ? 2'000'000 : -2'000'000;
  EXPECT_EQ(countOf(clean(fixes), FixVerdict::kKept), fixes.size()) << "stamps may waver";
}

/// The finest path that smoothing may ask for; more would be work without end.
void expectFewPoints(const std::vector<Fix>& fixes) {
  constexpr std::size_t kMostPerFix = 101;
  const CleanedTrajectory cleaned = clean(fixes);
  EXPECT_LE(cleaned.trajectory.points().size(), kMostPerFix * countOf(cleaned, FixVerdict::kKept));
}

TEST(TrajectoryCleaner, ARefusalTellsThatFixesWereTooFast) {
  std::vector<Fix> burst = record(block, 600.0);
  for (std::size_t i = 0; i < burst.size(); ++i) burst[i].stamp_ns = static_cast<std::int64_t>(i) * 1000;
  burst.back().stamp_ns += 95'000'000'000;  // no bridge is as long
  EXPECT_THAT(test::refusalOf<std::runtime_error>([&] { clean(burst); }),
              testing::HasSubstr("(2999 of 3001 are faster than 50 Hz)"));
}

TEST(TrajectoryCleaner, AFewFixesMakeAFewPointsWhateverTheirStamps) {
  std::vector<Fix> burst = record(block, 60.0);
  burst.insert(burst.begin(), 3000, burst.front());
  for (std::size_t i = 0; i < 3000; ++i) burst[i].stamp_ns -= 1000 * static_cast<std::int64_t>(3000 - i);
  expectFewPoints(burst);
  EXPECT_EQ(countOf(clean(burst), FixVerdict::kTooFast), 3000U);
  std::vector<Fix> supersonic = record([](double time_s) { return Eigen::Vector2d(1000.0 * time_s, 0.0); }, 100.0);
  supersonic.erase(supersonic.begin() + 50, supersonic.begin() + 450);  // 80 s
  expectFewPoints(supersonic);
}

TEST(TrajectoryCleaner, TooFewFixesAreAnError) {
  std::vector<Fix> fixes = record(block, 10.0);
  EXPECT_THROW(clean({}), std::runtime_error);
  EXPECT_THROW(clean({fixes[0]}), std::runtime_error);
  for (Fix& fix : fixes) fix.has_fix = false;
  EXPECT_THROW(clean(fixes), std::runtime_error);
}

TEST(TrajectoryCleaner, StandingThroughoutIsAPlace) {
  const Path standing = [](double) { return Eigen::Vector2d(3.0, 4.0); };
  for (const double noise_m : {0.0, 0.1}) {
    const CleanedTrajectory cleaned = clean(record(standing, 60.0, 5.0, noise_m));
    EXPECT_LT(largestOf(errorsOf(cleaned, standing, 60.0)), 0.5);
  }
}

TEST(TrajectoryCleaner, GarbageGivesAPathOrAnErrorButNeverNonsense) {
  std::mt19937 engine(5);
  std::uniform_real_distribution<double> anywhere(-95.0, 95.0);
  std::uniform_int_distribution<std::int64_t> any_time(std::numeric_limits<std::int64_t>::min() / 4,
                                                       std::numeric_limits<std::int64_t>::max() / 4);
  for (int round = 0; round < 200; ++round) {
    std::vector<Fix> fixes(static_cast<std::size_t>(round % 40));
    for (Fix& fix : fixes) fix = {any_time(engine), {anywhere(engine), 2.0 * anywhere(engine), 0.0}, round % 3 != 0};
    if (round % 2 == 0) {
      std::sort(fixes.begin(), fixes.end(), [](const Fix& a, const Fix& b) { return a.stamp_ns < b.stamp_ns; });
    }
    try {
      const CleanedTrajectory cleaned = clean(fixes);
      EXPECT_EQ(cleaned.verdicts.size(), fixes.size());
      EXPECT_GE(cleaned.trajectory.points().size(), 2u);
    } catch (const std::runtime_error& error) {
      EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
    }
  }
}

}  // namespace
}  // namespace visual_localization
