#include "geo/path_smoother.h"

#include <cmath>
#include <stdexcept>
#include <vector>

#include <gtest/gtest.h>

namespace visual_localization {
namespace {

/// Of the path between two times, in steps of a hundredth of a second.
double lengthOf(const SmoothedPath& path, double from_s, double to_s) {
  double length_m = 0.0;
  for (double time_s = from_s; time_s < to_s - 1e-9; time_s += 0.01) {
    length_m += (path.at(time_s + 0.01) - path.at(time_s)).norm();
  }
  return length_m;
}

TEST(PathSmoother, AStraightSteadyPathIsItsOwnSpline) {
  std::vector<PathSample> samples;
  for (const double time_s : {3.0, 3.4, 4.5, 5.0, 7.25, 8.0, 12.0, 12.1, 13.0}) {
    samples.push_back({time_s, {2.0 * time_s - 5.0, 1.0 - 0.5 * time_s}});
  }
  const SmoothedPath path = smoothPath(samples, {});
  for (double time_s = 3.0; time_s <= 13.0; time_s += 0.07) {
    EXPECT_LT((path.at(time_s) - Eigen::Vector2d(2.0 * time_s - 5.0, 1.0 - 0.5 * time_s)).norm(), 1e-6) << time_s;
  }
}

TEST(PathSmoother, OutsideOfItsTimesItIsItsEnds) {
  const SmoothedPath path = smoothPath({{1.0, {0.0, 0.0}}, {2.0, {1.0, 0.0}}, {5.0, {4.0, 0.0}}}, {});
  EXPECT_EQ(path.at(-100.0), path.positions_m.front());
  EXPECT_EQ(path.at(100.0), path.positions_m.back());
  EXPECT_LT((path.at(1.0) - Eigen::Vector2d(0.0, 0.0)).norm(), 1e-6);
  EXPECT_LT((path.at(5.0) - Eigen::Vector2d(4.0, 0.0)).norm(), 1e-6);
}

TEST(PathSmoother, TheGridHasThreeStepsASmoothingTime) {
  std::vector<PathSample> samples;
  for (int i = 0; i <= 100; ++i) samples.push_back({20.0 + 0.1 * i, {0.1 * i, 0.0}});
  PathSmootherConfig config;
  config.smoothing_time_s = 0.75;
  const SmoothedPath path = smoothPath(samples, config);
  EXPECT_EQ(path.positions_m.size(), 41U);
  EXPECT_EQ(path.step_s, 0.25);
  EXPECT_EQ(path.start_s, 20.0);
}

TEST(PathSmoother, ALongPauseIsNoReasonForAFineGrid) {
  const SmoothedPath path = smoothPath({{0.0, {0.0, 0.0}}, {1.0, {1.0, 0.0}}, {1e6, {2.0, 0.0}}}, {});
  EXPECT_EQ(path.positions_m.size(), 301U) << "a hundred steps a sample";
}

TEST(PathSmoother, TheShortestPathHasTwoSteps) {
  PathSmootherConfig config;
  config.smoothing_time_s = 100.0;
  EXPECT_EQ(smoothPath({{0.0, {0.0, 0.0}}, {0.1, {1.0, 0.0}}}, config).positions_m.size(), 3U);
}

/// Amplitude that is left of a small oscillation of `per_s` radians a second.
double responseTo(double per_s, double smoothing_time_s) {
  constexpr double kAmplitude_m = 0.01;
  std::vector<PathSample> samples;
  for (int i = 0; i <= 1200; ++i) {
    const double time_s = 0.05 * i;
    samples.push_back({time_s, {time_s, kAmplitude_m * std::sin(per_s * time_s)}});
  }
  PathSmootherConfig config;
  config.smoothing_time_s = smoothing_time_s;
  const SmoothedPath path = smoothPath(samples, config);
  double largest_m = 0.0;
  for (double time_s = 20.0; time_s < 40.0; time_s += 0.01) {
    largest_m = std::max(largest_m, std::abs(path.at(time_s).y()));
  }
  return largest_m / kAmplitude_m;
}

// A smoothing spline is a low pass of the fourth order: 1 / (1 + (omega T)^4).
TEST(PathSmoother, DetailsShorterThanTheSmoothingTimeAreGone) {
  EXPECT_NEAR(responseTo(1.0, 0.5), 1.0 / (1.0 + std::pow(0.5, 4)), 0.02);
  EXPECT_NEAR(responseTo(1.0, 1.0), 0.5, 0.02);
  EXPECT_NEAR(responseTo(2.0, 1.0), 1.0 / 17.0, 0.02);
}

TEST(PathSmoother, WhatLiesFarOffHasNoInfluence) {
  std::vector<PathSample> samples;
  for (int i = 0; i <= 100; ++i) samples.push_back({0.2 * i, {0.2 * i, 0.0}});
  const auto farthestWith = [&](double offset_m, double outlier_distance_m = 1.0) {
    samples[50].position_m.y() = offset_m;
    PathSmootherConfig config;
    config.outlier_distance_m = outlier_distance_m;
    const SmoothedPath path = smoothPath(samples, config);
    double farthest_m = 0.0;
    for (double time_s = 0.0; time_s <= 20.0; time_s += 0.1) {
      farthest_m = std::max(farthest_m, std::abs(path.at(time_s).y()));
    }
    return farthest_m;
  };
  const double small_m = farthestWith(0.1);
  EXPECT_GT(small_m, 0.003) << "the path bends towards a small deviation";
  EXPECT_LT(farthestWith(5.0), small_m) << "but not towards a large one";
  EXPECT_GT(farthestWith(2.0, 20.0), 10.0 * farthestWith(2.0, 0.5)) << "what is large is said by a parameter";
  EXPECT_LT(farthestWith(500.0), 0.01) << "weights have a floor, so that the system stays solvable";
}

TEST(PathSmoother, ThroughAGapItDrivesAtItsUsualSpeed) {
  std::vector<PathSample> samples;  // a right angle at 10 s, not seen
  for (int i = 0; i <= 100; ++i) {
    const double time_s = 0.2 * i;
    if (time_s > 6.0 && time_s < 14.0) continue;
    samples.push_back({time_s, {std::min(time_s, 10.0), std::max(0.0, time_s - 10.0)}});
  }
  PathSmootherConfig config;
  config.speed_mps = 1.0;
  const double without_m = lengthOf(smoothPath(samples, config), 6.0, 14.0);
  config.speed_share = 0.1;
  const double a_little_m = lengthOf(smoothPath(samples, config), 6.0, 14.0);
  EXPECT_GT(a_little_m, without_m + 0.01);
  config.speed_share = 1.0;
  EXPECT_GT(lengthOf(smoothPath(samples, config), 6.0, 14.0), a_little_m + 0.1);
  config.speed_share = 100.0;
  EXPECT_NEAR(lengthOf(smoothPath(samples, config), 6.0, 14.0), 8.0, 0.1);
}

TEST(PathSmoother, ARobotThatStoodIsNotMadeToDrive) {
  std::vector<PathSample> samples;
  for (int i = 0; i <= 200; ++i) {
    const double time_s = 0.2 * i;
    samples.push_back({time_s, {std::min(time_s, 10.0) + std::max(0.0, time_s - 30.0), 0.0}});
  }
  PathSmootherConfig config;
  config.speed_mps = 1.0;
  config.speed_share = 1.0;
  const SmoothedPath path = smoothPath(samples, config);
  EXPECT_NEAR(lengthOf(path, 15.0, 25.0), 0.0, 0.1) << "five smoothing times from stop and start";
  EXPECT_NEAR(lengthOf(path, 2.0, 8.0), 6.0, 0.1);
}

TEST(PathSmoother, FasterOrSlowerItIsTheSamePath) {
  const auto pathAt = [](double mps) {
    std::vector<PathSample> samples;  // a right angle, not seen
    for (int i = 0; i <= 100; ++i) {
      const double along_m = 0.2 * i;
      if (along_m > 6.0 && along_m < 14.0) continue;
      samples.push_back({along_m / mps, {std::min(along_m, 10.0), std::max(0.0, along_m - 10.0)}});
    }
    return smoothPath(samples, {1.0 / mps, 1.0, mps, 1.0});
  };
  const SmoothedPath walking = pathAt(1.0);
  for (const double mps : {0.25, 2.0}) {
    const SmoothedPath other = pathAt(mps);
    ASSERT_EQ(other.positions_m.size(), walking.positions_m.size());
    for (std::size_t k = 0; k < walking.positions_m.size(); ++k) {
      EXPECT_LT((other.positions_m[k] - walking.positions_m[k]).norm(), 1e-6) << mps << ' ' << k;
    }
  }
}

TEST(PathSmoother, OneSampleIsNoPath) {
  EXPECT_THROW(smoothPath({{0.0, {0.0, 0.0}}}, {}), std::invalid_argument);
  EXPECT_THROW(smoothPath({}, {}), std::invalid_argument);
}

}  // namespace
}  // namespace visual_localization
