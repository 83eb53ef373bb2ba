#include "geo/motion_scales.h"

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include <gtest/gtest.h>

namespace visual_localization {
namespace {

/// A node a second of a robot whose acceleration is white.
std::vector<PathSample> simulated(double density, double noise_m, int count) {
  std::mt19937 engine(7);
  std::normal_distribution<double> normal;
  std::vector<PathSample> nodes;
  Eigen::Vector2d position_m(0.0, 0.0);
  Eigen::Vector2d velocity_mps(1.0, 0.0);
  constexpr int kSteps = 20;
  for (int i = 0; i < count; ++i) {
    for (int k = 0; k < kSteps; ++k) {
      position_m += velocity_mps / kSteps;
      const double x = normal(engine);
      velocity_mps += std::sqrt(density / kSteps) * Eigen::Vector2d(x, normal(engine));
    }
    const double x = normal(engine);
    nodes.push_back({1.0 * i, position_m + noise_m * Eigen::Vector2d(x, normal(engine))});
  }
  return nodes;
}

TEST(StudentCost, GrowsLikeASquareAndThenSlowly) {
  EXPECT_EQ(studentCost(0.0), 0.0);
  EXPECT_NEAR(studentCost(0.01), 0.75 * 0.01, 1e-4);
  EXPECT_LT(studentCost(1e6), 40.0);
  EXPECT_EQ(studentWeight(0.0), 1.0);
  EXPECT_NEAR(studentWeight(56.0), 0.1, 1e-12);
}

TEST(LearnScales, FindsTheScalesOfASimulatedRecording) {
  for (const double scale : {0.1, 1.0}) {
    const MotionScales scales = learnScales(simulated(scale * scale, scale, 600), {}, 0.0);
    EXPECT_GT(scales.acceleration_density, scale * scale / 3.0);
    EXPECT_LT(scales.acceleration_density, scale * scale * 3.0);
    EXPECT_GT(scales.noise_m, scale / 1.6) << "the search is no finer";
    EXPECT_LT(scales.noise_m, scale * 1.6);
  }
}

TEST(LearnScales, RoundingLeavesNoise) {
  const std::vector<PathSample> nodes = simulated(0.01, 0.0, 200);
  EXPECT_LT(learnScales(nodes, {}, 0.0).noise_m, 0.1);
  EXPECT_GE(learnScales(nodes, {}, 0.0, {}, 0.3).noise_m, 0.3);
}

TEST(LearnScales, OutliersDecideLittle) {
  std::vector<PathSample> nodes = simulated(0.01, 0.1, 600);
  for (std::size_t i = 10; i < nodes.size(); i += 20) nodes[i].position_m.y() += 1e5;
  const MotionScales scales = learnScales(nodes, {}, 0.0);
  EXPECT_LT(scales.noise_m, 0.3);
  EXPECT_LT(scales.acceleration_density, 1.0);
}

/// Exact, at 1 m/s with four bends of a quarter of a turn.
std::vector<PathSample> bends() {
  std::vector<PathSample> nodes{{0.0, {0.0, 0.0}}};
  double yaw_rad = 0.0;
  for (int i = 1; i < 240; ++i) {
    if (i % 60 >= 50) yaw_rad += 0.05 * std::acos(-1.0);
    nodes.push_back({1.0 * i, nodes.back().position_m + Eigen::Vector2d(std::cos(yaw_rad), std::sin(yaw_rad))});
  }
  return nodes;
}

TEST(LearnScales, LongStraightsDoNotMakeBendsImprobable) {
  const std::vector<PathSample> nodes = bends();
  const MotionScales scales = learnScales(nodes, {}, 0.0);
  EXPECT_LT(*std::max_element(scales.mean_cost.begin(), scales.mean_cost.end()), 3.0);
  EXPECT_GT(scales.acceleration_density, 1e-3);
}

TEST(LearnScales, AParkedRobotMovesAtTheSpeedOfItsMotion) {
  std::vector<PathSample> nodes = simulated(0.0, 0.02, 60);
  for (int i = 0; i < 2000; ++i) {
    nodes.push_back({60.0 + i, nodes[59].position_m + Eigen::Vector2d(0.0, i % 2 == 0 ? 0.02 : -0.02)});
  }
  const MotionScales scales = learnScales(nodes, {}, 0.0);
  EXPECT_NEAR(scales.usual_mps, 1.0, 0.1);
}

TEST(LearnScales, WhatIsNotBelievedTeachesNothing) {
  std::vector<PathSample> nodes = simulated(0.01, 0.1, 300);
  std::vector<bool> believed(nodes.size(), true);
  for (std::size_t i = 50; i < 300; ++i) {
    nodes[i].position_m.y() += i % 2 == 0 ? 3.0 : -3.0;
    believed[i] = false;
  }
  EXPECT_LT(learnScales(nodes, believed, 0.0).noise_m, 0.3);
  EXPECT_GT(learnScales(nodes, {}, 0.0).noise_m, 0.5);
  EXPECT_GE(learnScales(nodes, believed, 5.0).acceleration_density, 5.0);
}

TEST(LearnScales, OfOneNode) {
  const MotionScales scales = learnScales({{0.0, {1.0, 2.0}}}, {}, 0.0);
  EXPECT_EQ(scales.mean_cost.size(), 1U);
  EXPECT_GT(scales.noise_m, 0.0);
}

}  // namespace
}  // namespace visual_localization
