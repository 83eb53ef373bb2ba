#include "geo/receiver_steps.h"

#include <cmath>
#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "test/geo/recorded_round.h"

namespace visual_localization {
namespace {

using test::Path;
using testing::ElementsAre;
using testing::IsEmpty;

constexpr double kRoad_s = 120.0;
constexpr double kPromised_m = 0.7;

/// A car that changes its speed between 12 and 18 m/s and its direction a little.
Eigen::Vector2d road(double time_s) {
  const double along_m = 15.0 * time_s + 24.0 * std::sin(time_s / 8.0);
  return {along_m, 30.0 * std::sin(along_m / 150.0)};
}

UsableFixes fixesOf(const Path& path, double rate_hz, double noise_m) {
  std::mt19937 engine(7);
  std::normal_distribution<double> noise(0.0, 1.0);
  UsableFixes fixes;
  for (double time_s = 0.0; time_s < kRoad_s; time_s += 1.0 / rate_hz) {
    const double x = noise(engine);
    fixes.samples.push_back({time_s, path(time_s) + noise_m * Eigen::Vector2d(x, noise(engine))});
    fixes.indices.push_back(fixes.indices.size());
    fixes.sigmas_m.push_back(kPromised_m);
  }
  return fixes;
}

UsableFixes shifted(UsableFixes fixes, std::size_t begin, std::size_t end, const Eigen::Vector2d& offset_m) {
  for (std::size_t i = begin; i < end; ++i) fixes.samples[i].position_m += offset_m;
  return fixes;
}

TEST(StepsIn, AreWhereThePositionJumpsOutAndBack) {
  for (const double noise_m : {0.0, 0.05}) {
    const UsableFixes fixes = fixesOf(road, 5.0, noise_m);
    for (const double angle_rad : {0.0, 1.0, 2.0, 3.0, 4.0, 5.0}) {
      const Eigen::Vector2d offset_m = 3.0 * Eigen::Vector2d(std::cos(angle_rad), std::sin(angle_rad));
      EXPECT_THAT(stepsIn(shifted(fixes, 200, 250, offset_m)), ElementsAre(200, 250)) << noise_m << ", " << angle_rad;
    }
  }
}

TEST(StepsIn, AreNeitherSpikesNorWhatARobotDrives) {
  const UsableFixes fixes = fixesOf(road, 5.0, 0.05);
  EXPECT_THAT(stepsIn(fixes), IsEmpty());
  EXPECT_THAT(stepsIn(shifted(fixes, 200, 201, {0.0, 40.0})), IsEmpty());
  EXPECT_THAT(stepsIn(shifted(shifted(fixes, 200, 201, {0.0, 40.0}), 202, 203, {5.0, 40.0})), IsEmpty());
  const Path brakes = [](double time_s) {  // from 20 m/s, with 9 m/s^2, and drives off again at once
    const double braked_s = std::clamp(time_s - 60.0, 0.0, 20.0 / 9.0);
    const double stood_s = std::max(0.0, time_s - 60.0 - 20.0 / 9.0);
    return Eigen::Vector2d(
        20.0 * (std::min(time_s, 60.0) + braked_s) - 4.5 * braked_s * braked_s + 2.0 * stood_s * stood_s, 0.0);
  };
  EXPECT_THAT(stepsIn(fixesOf(brakes, 5.0, 0.01)), IsEmpty());
}

TEST(StepsIn, AreNotSoughtAmongRareFixes) {
  EXPECT_THAT(stepsIn(shifted(fixesOf(road, 1.0, 0.05), 50, 60, {0.0, 8.0})), IsEmpty());
  EXPECT_THAT(stepsIn({}), IsEmpty());
}

std::vector<Fix> recordedOn(const Path& path) {
  std::vector<Fix> fixes = test::record(path, kRoad_s, 5.0, 0.05);
  for (Fix& fix : fixes) fix.sigma_m = kPromised_m;
  return fixes;
}

TEST(ReceiverSteps, AJumpOutAndBackDoesNotMoveThePath) {
  for (const double size_m : {3.0, 6.0, 30.0}) {
    for (const double angle_rad : {0.0, 1.5, 3.0, 4.5}) {
      std::vector<Fix> fixes = recordedOn(road);
      for (std::size_t i = 210; i < 260; ++i) {
        test::shift(fixes[i], size_m * Eigen::Vector2d(std::cos(angle_rad), std::sin(angle_rad)));
      }
      const CleanedTrajectory cleaned = test::clean(fixes);
      EXPECT_LT(test::largestOf(test::errorsOf(cleaned, road, kRoad_s)), 0.6) << size_m << " m, " << angle_rad;
      for (std::size_t i = 0; i < fixes.size(); ++i) {
        const bool jumped = i >= 210 && i < 260;
        EXPECT_EQ(cleaned.verdicts[i] == FixVerdict::kKept, !jumped) << size_m << " m, " << angle_rad << ", " << i;
      }
    }
  }
}

TEST(ReceiverSteps, FiveJumpsDoNotMakeARobotThatDrivesSo) {
  std::vector<Fix> fixes = recordedOn(road);
  for (std::size_t begin = 60; begin < 600; begin += 110) {
    for (std::size_t i = begin; i < begin + 25; ++i) test::shift(fixes[i], {4.0, -5.0});
  }
  EXPECT_LT(test::largestOf(test::errorsOf(test::clean(fixes), road, kRoad_s)), 0.6);
}

TEST(ReceiverSteps, AJumpThatStaysIsNotSharedAmongBothParts) {
  for (const double size_m : {5.0, 60.0}) {
    for (const std::size_t step : {240U, 300U, 360U}) {
      std::vector<Fix> fixes = recordedOn(road);
      for (std::size_t i = step; i < fixes.size(); ++i) test::shift(fixes[i], {0.0, size_m});
      const std::vector<double> errors_m = test::errorsOf(test::clean(fixes), road, kRoad_s);
      for (std::size_t second = 0; second + 3 < step / 5; ++second) {
        EXPECT_LT(errors_m[second], 0.6) << size_m << " m behind " << step << ", second " << second;
      }
    }
  }
}

}  // namespace
}  // namespace visual_localization
