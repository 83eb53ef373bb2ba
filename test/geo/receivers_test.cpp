// Robots and receivers of all kinds: the path is never worse than the raw fixes, and good fixes are believed.

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "base/time.h"
#include "test/geo/recorded_round.h"

namespace visual_localization {
namespace {

using test::clean;
using test::countOf;
using test::errorsOf;
using test::kDatum;
using test::largestOf;
using test::meanOf;
using test::Path;
using test::stampOf;
using test::timeOf;

/// By its speed and its turn rate at each time, in steps of 50 ms.
Path driven(double duration_s, const std::function<double(double)>& speed_mps,
            const std::function<double(double)>& rate_rad_s) {
  constexpr double kStep_s = 0.05;
  std::vector<Eigen::Vector2d> positions_m{{0.0, 0.0}};
  double yaw_rad = 0.3;
  for (double time_s = 0.0; time_s < duration_s + 1.0; time_s += kStep_s) {
    yaw_rad += kStep_s * rate_rad_s(time_s);
    const Eigen::Vector2d ahead(std::cos(yaw_rad), std::sin(yaw_rad));
    positions_m.emplace_back(positions_m.back() + kStep_s * speed_mps(time_s) * ahead);
  }
  return [positions_m](double time_s) -> Eigen::Vector2d {
    const double step = std::max(0.0, time_s / kStep_s);
    const auto left = std::min(static_cast<std::size_t>(step), positions_m.size() - 2);
    return positions_m[left] + (step - static_cast<double>(left)) * (positions_m[left + 1] - positions_m[left]);
  };
}

constexpr double kDrive_s = 600.0;

/// Stops at lights, turns at crossings.
Path car() {
  const auto phase = [](double time_s) { return std::fmod(time_s, 75.0); };
  return driven(
      kDrive_s,
      [phase](double time_s) {
        const double t = phase(time_s);
        return t < 20.0 ? 0.0 : std::min({2.0 * (t - 20.0), 12.0, 2.5 * (75.0 - t)});
      },
      [phase](double time_s) { return phase(time_s) > 60.0 && phase(time_s) < 64.0 ? 0.4 : 0.01; });
}

/// Straight rows with a stop and a turn on the spot at each end.
Path mower() {
  const auto phase = [](double time_s) { return std::fmod(time_s, 60.0); };
  return driven(
      kDrive_s, [phase](double time_s) { return phase(time_s) < 50.0 ? 0.6 : 0.0; },
      [phase](double time_s) { return phase(time_s) > 52.0 && phase(time_s) < 57.0 ? 0.2 * kPi : 0.0; });
}

Path walker() {
  return driven(
      kDrive_s, [](double time_s) { return 1.3 + 0.4 * std::sin(time_s / 9.0) + 0.2 * std::sin(time_s / 2.3); },
      [](double time_s) { return 0.25 * std::sin(time_s / 17.0); });
}

/// At one speed, but for half a minute.
Path slowForAWhile() {
  return driven(
      kDrive_s, [](double time_s) { return time_s > 200.0 && time_s < 236.0 ? 0.3 : 0.65; },
      [](double time_s) { return std::fmod(time_s, 60.0) < 4.0 ? 0.4 : 0.0; });
}

/// To five decimals, about a metre.
void roundCoordinates(Fix& fix) {
  fix.position.latitude_deg = std::round(fix.position.latitude_deg * 1e5) / 1e5;
  fix.position.longitude_deg = std::round(fix.position.longitude_deg * 1e5) / 1e5;
}

/// White noise and a Gauss-Markov error, metres and seconds.
struct Receiver {
  std::string name;
  double rate_hz = 1.0;
  double white_m = 0.0;
  double slow_m = 0.0;
  double correlation_s = 100.0;
  double sigma_m = 0.0;  ///< as it claims
};

const std::vector<Receiver> kReceivers{{"geodetic", 10.0, 0.02, 1.0, 200.0, 0.0},
                                       {"u-blox", 5.0, 0.1, 1.2, 100.0, 1.5},
                                       {"telephone", 1.0, 1.5, 3.0, 40.0, 0.0},
                                       {"fixed", 5.0, 0.01, 0.0, 1.0, 0.02},
                                       {"slow", 0.5, 0.3, 1.0, 120.0, 0.0}};

std::vector<Fix> recordedBy(const Path& path, const Receiver& receiver) {
  std::vector<Fix> fixes = test::record(path, kDrive_s, receiver.rate_hz, receiver.white_m);
  std::mt19937 engine(5);
  std::normal_distribution<double> normal;
  const double kept = std::exp(-1.0 / (receiver.rate_hz * receiver.correlation_s));
  Eigen::Vector2d error_m(0.0, 0.0);
  for (Fix& fix : fixes) {
    const double x = normal(engine);
    error_m = kept * error_m + receiver.slow_m * std::sqrt(1.0 - kept * kept) * Eigen::Vector2d(x, normal(engine));
    test::shift(fix, error_m);
    fix.sigma_m = receiver.sigma_m;
  }
  return fixes;
}

/// Of the raw fixes, interpolated, where errorsOf() judges.
double rawError_m(const std::vector<Fix>& fixes, const Path& path) {
  const LocalFrame frame(kDatum);
  std::vector<TrajectoryPoint> points;
  for (const Fix& fix : fixes) points.push_back({fix.stamp_ns, frame.toEastNorth(fix.position), 0.0});
  CleanedTrajectory raw;
  raw.trajectory = Trajectory(points);
  return meanOf(errorsOf(raw, path, kDrive_s));
}

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

TEST(Receivers, RoundedCoordinatesAreNeitherStepsNorMultipath) {
  const Path drive = car();
  const Path parked = [drive](double time_s) { return drive(std::max(0.0, time_s - 350.0)); };
  const std::vector<std::pair<std::string, Path>> robots{{"parked car", parked}, {"mower", mower()}};
  for (const auto& [robot, path] : robots) {
    for (const double rate_hz : {1.0, 5.0, 10.0}) {
      SCOPED_TRACE(robot + ", " + std::to_string(rate_hz) + " Hz");
      std::vector<Fix> fixes = recordedBy(path, {"DGPS", rate_hz, 0.05, 0.8, 300.0, 0.8});
      for (Fix& fix : fixes) roundCoordinates(fix);
      const CleanedTrajectory cleaned = clean(fixes);
      EXPECT_LE(meanOf(errorsOf(cleaned, path, kDrive_s)), 1.05 * rawError_m(fixes, path));
      EXPECT_GE(countOf(cleaned, FixVerdict::kKept), fixes.size() * 95 / 100);
    }
  }
}

TEST(Receivers, LateStampsAreNoSteps) {
  const Path drive = car();
  const Path parked = [drive](double time_s) { return drive(std::max(0.0, time_s - 350.0)); };
  for (const double rate_hz : {5.0, 10.0}) {
    for (const double sigma_m : {0.0, 0.05}) {
      std::vector<Fix> fixes = recordedBy(parked, {"exact", rate_hz, 0.01, 0.0, 1.0, sigma_m});
      std::mt19937 engine(3);
      std::exponential_distribution<double> late(1.0 / 0.02);
      std::uniform_real_distribution<double> uniform;
      std::int64_t before_ns = 0;
      for (Fix& fix : fixes) {  // a busy driver: what waits is stamped behind what came before
        const double stuck_s = uniform(engine) < 0.03 ? 0.1 + 0.3 * uniform(engine) : 0.0;
        fix.stamp_ns += static_cast<std::int64_t>(1e9 * (late(engine) + stuck_s));
        fix.stamp_ns = std::max(fix.stamp_ns, before_ns + 1000);
        before_ns = fix.stamp_ns;
      }
      EXPECT_LE(meanOf(errorsOf(clean(fixes), parked, kDrive_s)), 1.1 * rawError_m(fixes, parked) + 0.01)
          << rate_hz << " Hz, " << sigma_m << " m";
    }
  }
}

TEST(Receivers, ARobotThatDrivesMoreSlowlyForAWhileIsBelieved) {
  const Path path = slowForAWhile();
  for (const double rate_hz : {1.0, 5.0}) {
    const std::vector<Fix> fixes = recordedBy(path, {"exact", rate_hz, 0.01, 0.0, 1.0, 0.05});
    const CleanedTrajectory cleaned = clean(fixes);
    EXPECT_LT(meanOf(errorsOf(cleaned, path, kDrive_s)), 0.05) << rate_hz << " Hz";
    EXPECT_GE(countOf(cleaned, FixVerdict::kKept), fixes.size() * 95 / 100) << rate_hz << " Hz";
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

/// Errors of all kinds that receivers make, over the noise that `engine` draws.
struct ErrorKind {
  std::string name;
  double white_m = 0.02;
  double slow_m = 0.4;         ///< Gauss-Markov over 100 s
  double step_m = 0.0;         ///< steps aside, about once a minute for 5 to 25 s
  double bend_m = 0.0;         ///< bends aside as often
  double spike_share = 0.0;    ///< of the fixes are 15 m off
  double sigma_m = 0.7;        ///< as it claims
  double sigma_aside_m = 0.7;  ///< while it is aside
};

std::vector<Fix> recordedWith(const ErrorKind& kind, const Path& path, double rate_hz, std::uint32_t seed) {
  std::mt19937 engine(seed);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform;
  const auto inPlane = [&] {
    const double x = normal(engine);
    return Eigen::Vector2d(x, normal(engine));
  };
  const double kept = std::exp(-1.0 / (100.0 * rate_hz));
  std::vector<Fix> fixes = test::record(path, kDrive_s, rate_hz, 0.0);
  Eigen::Vector2d slow_m = kind.slow_m * inPlane();
  double begin_s = 30.0;
  double end_s = 40.0;
  Eigen::Vector2d aside = inPlane().normalized();
  for (Fix& fix : fixes) {
    slow_m = kept * slow_m + std::sqrt(1.0 - kept * kept) * kind.slow_m * inPlane();
    Eigen::Vector2d error_m = slow_m + kind.white_m * inPlane();
    if (timeOf(fix) > end_s) {
      begin_s = end_s + 30.0 + 60.0 * uniform(engine);
      end_s = begin_s + 5.0 + 20.0 * uniform(engine);
      aside = (0.5 + uniform(engine)) * inPlane().normalized();
    }
    const bool is_aside = timeOf(fix) >= begin_s;
    if (is_aside) {
      const double bent = std::sin(kPi * (timeOf(fix) - begin_s) / (end_s - begin_s));
      error_m += (kind.step_m + kind.bend_m * bent * bent) * aside;
    }
    if (uniform(engine) < kind.spike_share) error_m += 15.0 * inPlane();
    test::shift(fix, error_m);
    fix.sigma_m = is_aside ? kind.sigma_aside_m : kind.sigma_m;
  }
  return fixes;
}

TEST(Receivers, HardlyAnyLogIsMadeWorse) {
  constexpr double kWorse = 1.1;
  constexpr double kMostOften = 0.02;
  constexpr double kMost = 2.0;
  constexpr double kRounding_m = 0.01;
  const std::vector<ErrorKind> kinds{{"DGPS", 0.05, 0.8},
                                     {"u-blox", 0.1, 1.2, 0.0, 0.0, 0.0, 1.5, 1.5},
                                     {"white", 1.0, 0.5, 0.0, 0.0, 0.0, 1.2, 1.2},
                                     {"float and fixed", 0.01, 0.0, 1.0, 0.0, 0.0, 0.02, 1.0},
                                     {"jumps", 0.05, 0.4, 6.0},
                                     {"multipath", 0.05, 0.4, 0.0, 8.0},
                                     {"spikes", 0.05, 0.4, 0.0, 0.0, 0.03},
                                     {"exact", 0.01, 0.0, 0.0, 0.0, 0.0, 0.05, 0.05}};
  const std::vector<std::pair<std::string, Path>> robots{
      {"car", car()}, {"mower", mower()}, {"walker", walker()}, {"slow for a while", slowForAWhile()}};
  std::size_t logs = 0;
  std::size_t worse = 0;
  for (const auto& [robot, path] : robots) {
    for (const ErrorKind& kind : kinds) {
      for (const double rate_hz : {1.0, 5.0}) {
        for (const std::string variant : {"plain", "undeclared", "rounded"}) {
          std::vector<Fix> fixes = recordedWith(kind, path, rate_hz, static_cast<std::uint32_t>(logs));
          for (Fix& fix : fixes) {
            if (variant == "undeclared") fix.sigma_m = 0.0;
            if (variant == "rounded") roundCoordinates(fix);
          }
          const double most_m = rawError_m(fixes, path) + kRounding_m;
          const double error_m = meanOf(errorsOf(clean(fixes), path, kDrive_s));
          EXPECT_LE(error_m, kMost * most_m) << robot << ", " << kind.name << ", " << rate_hz << " Hz, " << variant;
          worse += error_m > kWorse * most_m ? 1 : 0;
          ++logs;
        }
      }
    }
  }
  EXPECT_LE(static_cast<double>(worse), kMostOften * static_cast<double>(logs));
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
