// Logs that are made: what drivers do to fixes, and errors of all kinds on all robots.

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>
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
using test::kDrive_s;
using test::meanOf;
using test::mower;
using test::parkedCar;
using test::Path;
using test::rawError_m;
using test::Receiver;
using test::recordedBy;
using test::roundCoordinates;
using test::slowForAWhile;
using test::timeOf;
using test::walker;

TEST(MadeLogs, RoundedCoordinatesAreNeitherStepsNorMultipath) {
  const std::vector<std::pair<std::string, Path>> robots{{"parked car", parkedCar()}, {"mower", mower()}};
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

TEST(MadeLogs, LateStampsAreNoSteps) {
  const Path parked = parkedCar();
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

TEST(MadeLogs, ARobotThatDrivesMoreSlowlyForAWhileIsBelieved) {
  const Path path = slowForAWhile();
  for (const double rate_hz : {1.0, 5.0}) {
    const std::vector<Fix> fixes = recordedBy(path, {"exact", rate_hz, 0.01, 0.0, 1.0, 0.05});
    const CleanedTrajectory cleaned = clean(fixes);
    EXPECT_LT(meanOf(errorsOf(cleaned, path, kDrive_s)), 0.05) << rate_hz << " Hz";
    EXPECT_GE(countOf(cleaned, FixVerdict::kKept), fixes.size() * 95 / 100) << rate_hz << " Hz";
  }
}

/// What receivers err by, beside the errors of `receiver`.
struct ErrorKind {
  Receiver receiver;
  double step_m = 0.0;         ///< steps aside, about once a minute for 5 to 25 s
  double bend_m = 0.0;         ///< bends aside as often
  double spike_share = 0.0;    ///< of the fixes are 15 m off
  double sigma_aside_m = 0.0;  ///< as it claims while it is aside; 0: as always
};

std::vector<Fix> recordedWith(const ErrorKind& kind, const Path& path, double rate_hz, std::uint32_t seed) {
  Receiver receiver = kind.receiver;
  receiver.rate_hz = rate_hz;
  std::vector<Fix> fixes = recordedBy(path, receiver, seed);
  std::mt19937 engine(seed + 1000);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform;
  const auto inPlane = [&] {
    const double x = normal(engine);
    return Eigen::Vector2d(x, normal(engine));
  };
  double begin_s = 30.0;
  double end_s = 40.0;
  Eigen::Vector2d aside = inPlane().normalized();
  for (Fix& fix : fixes) {
    if (timeOf(fix) > end_s) {
      begin_s = end_s + 30.0 + 60.0 * uniform(engine);
      end_s = begin_s + 5.0 + 20.0 * uniform(engine);
      aside = (0.5 + uniform(engine)) * inPlane().normalized();
    }
    if (timeOf(fix) >= begin_s) {
      const double bent = std::sin(kPi * (timeOf(fix) - begin_s) / (end_s - begin_s));
      test::shift(fix, (kind.step_m + kind.bend_m * bent * bent) * aside);
      if (kind.sigma_aside_m > 0.0) fix.sigma_m = kind.sigma_aside_m;
    }
    if (uniform(engine) < kind.spike_share) test::shift(fix, 15.0 * inPlane());
  }
  return fixes;
}

TEST(MadeLogs, HardlyAnyLogIsMadeWorse) {
  constexpr double kWorse = 1.1;
  constexpr double kMostOften = 0.02;
  constexpr double kMost = 2.0;
  constexpr double kRounding_m = 0.01;
  const std::vector<ErrorKind> kinds{{{"DGPS", 1.0, 0.05, 0.8, 100.0, 0.7}},
                                     {{"u-blox", 1.0, 0.1, 1.2, 100.0, 1.5}},
                                     {{"white", 1.0, 1.0, 0.5, 100.0, 1.2}},
                                     {{"float and fixed", 1.0, 0.01, 0.0, 100.0, 0.02}, 1.0, 0.0, 0.0, 1.0},
                                     {{"jumps", 1.0, 0.05, 0.4, 100.0, 0.7}, 6.0},
                                     {{"multipath", 1.0, 0.05, 0.4, 100.0, 0.7}, 0.0, 8.0},
                                     {{"spikes", 1.0, 0.05, 0.4, 100.0, 0.7}, 0.0, 0.0, 0.03},
                                     {{"exact", 1.0, 0.01, 0.0, 100.0, 0.05}}};
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
          EXPECT_LE(error_m, kMost * most_m)
              << robot << ", " << kind.receiver.name << ", " << rate_hz << " Hz, " << variant;
          worse += error_m > kWorse * most_m ? 1 : 0;
          ++logs;
        }
      }
    }
  }
  EXPECT_LE(static_cast<double>(worse), kMostOften * static_cast<double>(logs));
}

}  // namespace
}  // namespace visual_localization
