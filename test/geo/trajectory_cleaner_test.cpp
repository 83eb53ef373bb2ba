#include "visual_localization/geo/trajectory_cleaner.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <random>
#include <stdexcept>

#include <gtest/gtest.h>

#include "base/angles.h"
#include "base/time.h"

namespace visual_localization {
namespace {

constexpr double kSpeed = 0.65;  // m/s
constexpr double kRate = 5.0;    // fixes per second
const GeodeticPoint kDatum{48.5345, 9.0713, 445.0};

using Path = std::function<Eigen::Vector2d(double time_s)>;

/// Around a block of 60 m x 40 m with corners of 5 m radius, counter-clockwise.
Eigen::Vector2d block(double time_s) {
  const double length_m = 50.0;
  const double width_m = 30.0;
  const double radius_m = 5.0;
  const double arc_m = radius_m * kPi / 2.0;
  double along_m = std::fmod(kSpeed * time_s, 2.0 * (length_m + width_m) + 4.0 * arc_m);
  Eigen::Vector2d position(0.0, 0.0);
  double yaw_rad = 0.0;
  for (const double side_m : {length_m, width_m, length_m, width_m}) {
    const Eigen::Vector2d ahead(std::cos(yaw_rad), std::sin(yaw_rad));
    const Eigen::Vector2d left(-ahead.y(), ahead.x());
    if (along_m < side_m) return position + along_m * ahead;
    position += side_m * ahead;
    along_m -= side_m;
    const double turned_rad = std::min(along_m, arc_m) / radius_m;
    const Eigen::Vector2d turned = radius_m * (std::sin(turned_rad) * ahead + (1.0 - std::cos(turned_rad)) * left);
    if (along_m < arc_m) return position + turned;
    position += turned;
    along_m -= arc_m;
    yaw_rad += kPi / 2.0;
  }
  return position;
}

/// A round that a receiver with 12 cm of noise recorded.
std::vector<Fix> record(const Path& path, double duration_s, double rate_hz = kRate, double noise_m = 0.12) {
  std::mt19937 engine(17);
  std::normal_distribution<double> noise(0.0, 1.0);
  const LocalFrame frame(kDatum);
  std::vector<Fix> fixes;
  for (double time_s = 0.0; time_s < duration_s; time_s += 1.0 / rate_hz) {
    const double x = noise(engine);
    const Eigen::Vector2d position = path(time_s) + noise_m * Eigen::Vector2d(x, noise(engine));
    fixes.push_back({1226500000000000000 + static_cast<std::int64_t>(time_s * 1e9), frame.toGeodetic(position), true});
  }
  return fixes;
}

double timeOf(const Fix& fix) { return secondsBetween(1226500000000000000, fix.stamp_ns); }

void shift(Fix& fix, const Eigen::Vector2d& offset_m) {
  const LocalFrame frame(kDatum);
  fix.position = frame.toGeodetic(frame.toEastNorth(fix.position) + offset_m);
}

CleanedTrajectory clean(const std::vector<Fix>& fixes) {
  return cleanTrajectory(fixes, LocalFrame(kDatum), TrajectoryCleanerConfig());
}

/// Distances from the true path at every second, where the cleaned one is known.
std::vector<double> errorsOf(const CleanedTrajectory& cleaned, const Path& path, double duration_s) {
  std::vector<double> errors_m;
  for (double time_s = 0.5; time_s < duration_s - 1.0; time_s += 1.0) {
    const auto point = cleaned.trajectory.at(1226500000000000000 + static_cast<std::int64_t>(time_s * 1e9));
    if (point) errors_m.push_back((point->position_m - path(time_s)).norm());
  }
  return errors_m;
}

double meanOf(const std::vector<double>& values) {
  double sum = 0.0;
  for (const double value : values) sum += value;
  return sum / static_cast<double>(values.size());
}

double largestOf(const std::vector<double>& values) { return *std::max_element(values.begin(), values.end()); }

std::size_t countOf(const CleanedTrajectory& cleaned, FixVerdict verdict) {
  return static_cast<std::size_t>(std::count(cleaned.verdicts.begin(), cleaned.verdicts.end(), verdict));
}

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
    const auto point = cleaned.trajectory.at(1226500000000000000 + static_cast<std::int64_t>(time_s * 1e9));
    ASSERT_TRUE(point);
    EXPECT_LT(std::abs(angleDifference(std::atan2(ahead.y(), ahead.x()), point->yaw_rad)), 0.15);
  }
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

TEST(TrajectoryCleaner, StampsThatStandStillOrGoBackAreDropped) {
  std::vector<Fix> fixes = record(block, 60.0);
  fixes[100].stamp_ns = fixes[99].stamp_ns;
  fixes[200].stamp_ns = fixes[10].stamp_ns;
  const CleanedTrajectory cleaned = clean(fixes);
  EXPECT_EQ(cleaned.verdicts[100], FixVerdict::kDisordered);
  EXPECT_EQ(cleaned.verdicts[200], FixVerdict::kDisordered);
  EXPECT_EQ(countOf(cleaned, FixVerdict::kDisordered), 2u);
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
  burst.back().stamp_ns += 80'000'000'000;
  try {
    clean(burst);
    ADD_FAILURE() << "accepted";
  } catch (const std::runtime_error& error) {
    EXPECT_NE(std::string(error.what()).find("(2999 of 3001 are faster than 50 Hz)"), std::string::npos)
        << error.what();
  }
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
