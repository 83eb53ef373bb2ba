#include "geo/path_smoother.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

namespace visual_localization {
namespace {

constexpr Motion kWalk{0.01, 1.0};

/// East at 1 m/s, a measurement a second, exact but for what its receiver says.
std::vector<Measurement> eastward(int count, double white_m = 0.05, double offset_m = 1.0) {
  std::vector<Measurement> measurements;
  for (int i = 0; i < count; ++i) {
    measurements.push_back({{1.0 * i, {1.0 * i, 0.0}}, white_m, offset_m});
  }
  return measurements;
}

TEST(PathSmoother, AStraightSteadyPathStaysOne) {
  for (const PathState& state : smoothPath(eastward(30), kWalk)) {
    EXPECT_LT((state.position_m - Eigen::Vector2d(state.time_s, 0.0)).norm(), 0.02) << state.time_s;
    EXPECT_NEAR(state.velocity_mps.x(), 1.0, 0.02) << state.time_s;
  }
}

TEST(PathSmoother, OneMeasurementIsAState) {
  const std::vector<PathState> path = smoothPath({{{3.0, {1.0, 2.0}}}}, kWalk);
  ASSERT_EQ(path.size(), 1U);
  EXPECT_EQ(path[0].position_m, Eigen::Vector2d(1.0, 2.0));
}

TEST(PathSmoother, NoiseIsSmoothedAsFarAsTheMotionAllows) {
  std::vector<Measurement> measurements = eastward(60, 0.5);
  for (std::size_t i = 0; i < measurements.size(); ++i) measurements[i].sample.position_m.y() = i % 2 == 0 ? 0.5 : -0.5;
  const std::vector<PathState> stiff = smoothPath(measurements, kWalk);
  const std::vector<PathState> soft = smoothPath(measurements, {10.0, 1.0});
  EXPECT_LT(std::abs(stiff[30].position_m.y()), 0.05);
  EXPECT_GT(std::abs(soft[30].position_m.y()), 0.2);
}

TEST(PathSmoother, AReceiverThatStepsAsideForAWhileDoesNotMoveThePath) {
  std::vector<Measurement> measurements = eastward(60);
  for (std::size_t i = 20; i < 26; ++i) measurements[i].sample.position_m.y() = 6.0;
  measurements[20].steps = measurements[26].steps = true;
  const std::vector<PathState> path = smoothPath(measurements, kWalk);
  for (const PathState& state : path) EXPECT_LT(std::abs(state.position_m.y()), 0.3) << state.time_s;
  EXPECT_NEAR(path[23].offset_m.y(), 6.0, 0.4);
}

TEST(PathSmoother, WhoPromisesMoreDecides) {
  std::vector<Measurement> measurements = eastward(60, 0.02, 0.02);
  for (std::size_t i = 20; i < 45; ++i) {
    measurements[i].sample.position_m.y() = 1.0;
    measurements[i].offset_m = 0.8;
  }
  for (const PathState& state : smoothPath(measurements, kWalk)) {
    EXPECT_LT(std::abs(state.position_m.y()), 0.1) << state.time_s;
  }
}

TEST(PathSmoother, PromisesThatVaryALittleAreNoSteps) {
  std::vector<Measurement> measurements = eastward(60, 0.02);
  for (std::size_t i = 0; i < measurements.size(); ++i) {
    measurements[i].offset_m = i % 2 == 0 ? 1.0 : 3.0;
    if (i >= 30) measurements[i].sample.position_m = {30.0, 1.0 * static_cast<double>(i) - 30.0};  // a corner
  }
  for (const PathState& state : smoothPath(measurements, {0.1, 1.0})) {
    const Eigen::Vector2d truth =
        state.time_s < 30.0 ? Eigen::Vector2d(state.time_s, 0.0) : Eigen::Vector2d(30.0, state.time_s - 30.0);
    EXPECT_LT((state.position_m - truth).norm(), 0.2) << state.time_s;
  }
}

TEST(PathSmoother, AStepThatNothingTellsAsideIsBelieved) {
  for (const bool creeps : {false, true}) {  // a promise that is another one by its first value alone
    std::vector<Measurement> measurements = eastward(60, 0.02);
    for (std::size_t i = 30; i < 60; ++i) measurements[i].sample.position_m.y() = 3.0;
    for (std::size_t i = 1; creeps && i < 60; ++i) measurements[i].offset_m = i < 30 ? 4.9 : 5.1;
    measurements[30].steps = true;
    const std::vector<PathState> path = smoothPath(measurements, {0.1, 1.0});
    for (const std::size_t i : {0U, 15U, 25U, 35U, 45U, 59U}) {
      EXPECT_LT((path[i].position_m - measurements[i].sample.position_m).norm(), 0.3) << creeps << ", " << i;
    }
  }
}

TEST(PathSmoother, AWayAsideThatDoesNotComeBackIsBelieved) {
  std::vector<Measurement> measurements = eastward(120, 0.02);
  for (const std::size_t begin : {20U, 60U}) {
    for (std::size_t i = begin; i < begin + 6; ++i) measurements[i].sample.position_m.y() = 6.0;
    measurements[begin].steps = measurements[begin + 6].steps = true;
  }
  for (std::size_t i = 100; i < 120; ++i) measurements[i].sample.position_m.y() = 6.0;
  measurements[100].steps = true;
  const std::vector<PathState> path = smoothPath(measurements, {0.1, 1.0});
  for (const std::size_t i : {10U, 23U, 40U, 63U, 80U, 95U}) EXPECT_LT(std::abs(path[i].position_m.y()), 0.3) << i;
  for (const std::size_t i : {105U, 110U, 119U}) EXPECT_NEAR(path[i].position_m.y(), 6.0, 0.3) << i;
}

TEST(PathSmoother, WhatIsAsideShapesTheWayBetween) {
  const auto truth = [](double time_s) { return Eigen::Vector2d(10.0 * time_s, 15.0 * std::sin(time_s / 5.0)); };
  std::vector<Measurement> measurements;
  for (int i = 0; i < 60; ++i) {
    measurements.push_back({{1.0 * i, truth(i)}, 0.05, 1.0});
    if (i < 20 || i >= 35) continue;
    measurements.back().aside = true;
    measurements.back().sample.position_m += Eigen::Vector2d(-4.0, 8.0);
  }
  const auto largestOf = [&](const std::vector<PathState>& path) {
    double largest_m = 0.0;
    for (double time_s = 20.0; time_s < 35.0; time_s += 1.0) {
      const auto behind = std::find_if(path.begin(), path.end(), [&](const PathState& s) { return s.time_s > time_s; });
      largest_m = std::max(largest_m, (between(*(behind - 1), *behind, time_s).position_m - truth(time_s)).norm());
    }
    return largest_m;
  };
  EXPECT_LT(largestOf(smoothPath(measurements, {1.0, 10.0})), 1.0);
  measurements.erase(measurements.begin() + 20, measurements.begin() + 35);
  EXPECT_GT(largestOf(smoothPath(measurements, {1.0, 10.0})), 2.5);
}

TEST(PathSmoother, WhatIsAsideOnlyBoundsWhatIsNotKnown) {
  std::vector<Measurement> known = eastward(30);
  known[15].aside = true;
  known[15].sample.position_m.y() = 20.0;
  EXPECT_LT(std::abs(smoothPath(known, kWalk)[15].position_m.y()), 0.1) << "beside good ones it says nothing";
  std::vector<Measurement> gap{known.begin(), known.begin() + 5};  // its ends lead apart
  for (int i = 0; i < 5; ++i) gap.push_back({{60.0 + i, {60.0, 1.0 * i}}, 0.05, 1.0});
  const double open_m = between(smoothPath(gap, kWalk)[4], smoothPath(gap, kWalk)[5], 32.0).position_m.y();
  gap.insert(gap.begin() + 5, {{32.0, {32.0, 30.0}}, 0.05, 1.0, false, true});
  const double bounded_m = smoothPath(gap, kWalk)[5].position_m.y();
  EXPECT_GT(bounded_m, open_m + 0.3);
  EXPECT_LT(bounded_m, 30.0);
}

TEST(PathSmoother, WhatIsNotMeasuredIsLessCertain) {
  std::vector<Measurement> measurements = eastward(60);
  measurements.erase(measurements.begin() + 20, measurements.begin() + 40);
  const std::vector<PathState> path = smoothPath(measurements, kWalk);
  const double beside = readingAt(path, kWalk, {10.5, {10.5, 0.0}}).variance;
  EXPECT_GT(readingAt(path, kWalk, {29.5, {29.5, 0.0}}).variance, 10.0 * beside);
  EXPECT_GT(readingAt(path, kWalk, {70.0, {70.0, 0.0}}).variance, 10.0 * beside) << "beyond the end";
  EXPECT_NEAR(readingAt(path, kWalk, {29.5, {29.5, 0.0}}).position_m.x(), 29.5, 0.3);
  EXPECT_NEAR(readingAt(path, kWalk, {62.0, {62.0, 0.0}}).position_m.x(), 62.0, 0.3);
  EXPECT_NEAR(readingAt(path, kWalk, {-2.0, {-2.0, 0.0}}).position_m.x(), -2.0, 0.3);
}

TEST(Between, MeetsItsEndsAndTheirVelocities) {
  PathState before;
  before.velocity_mps = {1.0, 0.0};
  PathState after;
  after.time_s = 4.0;
  after.position_m = {3.0, 2.0};
  after.velocity_mps = {0.0, 1.0};
  EXPECT_LT((between(before, after, 0.0).position_m - before.position_m).norm(), 1e-12);
  EXPECT_LT((between(before, after, 4.0).position_m - after.position_m).norm(), 1e-12);
  EXPECT_LT((between(before, after, 0.0).velocity_mps - before.velocity_mps).norm(), 1e-12);
  EXPECT_LT((between(before, after, 4.0).velocity_mps - after.velocity_mps).norm(), 1e-12);
  const double h = 1e-6;
  const Eigen::Vector2d rise =
      (between(before, after, 1.5 + h).position_m - between(before, after, 1.5 - h).position_m) / (2.0 * h);
  EXPECT_LT((between(before, after, 1.5).velocity_mps - rise).norm(), 1e-6);
}

TEST(Between, WhoStopsDoesNotSwingBeyond) {
  PathState before;
  before.velocity_mps = {10.0, 0.0};
  PathState after;
  after.time_s = 5.0;
  after.position_m = {1.0, 0.0};
  for (double time_s = 0.0; time_s <= 5.0; time_s += 0.1) {
    EXPECT_LE(between(before, after, time_s).position_m.x(), 1.0 + 1e-9) << time_s;
  }
}

}  // namespace
}  // namespace visual_localization
