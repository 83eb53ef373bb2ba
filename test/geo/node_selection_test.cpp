#include "geo/node_selection.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

namespace visual_localization {
namespace {

constexpr double kBridge_s = 90.0;

/// A second apart, at a speed that varies, with bends.
std::vector<PathSample> drive(int count) {
  std::vector<PathSample> nodes{{0.0, {0.0, 0.0}}};
  for (int i = 1; i < count; ++i) {
    const double speed_mps = 2.0 + std::sin(i / 10.0);
    const double yaw_rad = std::sin(i / 25.0);
    const Eigen::Vector2d way_m = speed_mps * Eigen::Vector2d(std::cos(yaw_rad), std::sin(yaw_rad));
    nodes.push_back({1.0 * i, nodes.back().position_m + way_m + 0.05 * Eigen::Vector2d(i % 2, (i / 2) % 2)});
  }
  return nodes;
}

std::vector<NodeVerdict> select(const std::vector<PathSample>& nodes, double tolerance = 0.0) {
  const MotionScales scales = learnScales(nodes, {}, 0.0);
  return selectNodes(nodes, scales, SpeedPrior(nodes, scales, tolerance), kBridge_s);
}

std::ptrdiff_t countOf(const std::vector<NodeVerdict>& verdicts, NodeVerdict verdict) {
  return std::count(verdicts.begin(), verdicts.end(), verdict);
}

TEST(SelectNodes, ADriveIsBelieved) { EXPECT_EQ(countOf(select(drive(300)), NodeVerdict::kBelieved), 300); }

TEST(SelectNodes, WhatLiesFarOffIsLeftOut) {
  for (const std::size_t first : {0U, 1U, 150U, 299U}) {
    std::vector<PathSample> nodes = drive(300);
    nodes[first].position_m += Eigen::Vector2d(-300.0, 500.0);
    const std::vector<NodeVerdict> verdicts = select(nodes);
    EXPECT_EQ(countOf(verdicts, NodeVerdict::kLeftOut), 1) << first;
    EXPECT_EQ(verdicts[first], NodeVerdict::kLeftOut) << first;
  }
}

TEST(SelectNodes, AStepOfTheReceiverIsOne) {
  std::vector<PathSample> nodes = drive(300);
  for (std::size_t i = 100; i < 160; ++i) nodes[i].position_m += Eigen::Vector2d(4.0, -3.0);
  const std::vector<NodeVerdict> verdicts = select(nodes);
  EXPECT_EQ(verdicts[100], NodeVerdict::kStep);
  EXPECT_EQ(verdicts[160], NodeVerdict::kStep);
  EXPECT_EQ(countOf(verdicts, NodeVerdict::kBelieved), 298);
}

TEST(SelectNodes, ABendThatAConstantSpeedCannotDriveLosesAsAWhole) {
  std::vector<PathSample> nodes;
  for (int i = 0; i < 300; ++i) nodes.push_back({1.0 * i, {0.65 * i, 0.05 * (i % 2)}});
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    const double away_s = (static_cast<double>(i) - 150.0) / 5.0;
    nodes[i].position_m.y() += 8.0 * std::exp(-0.5 * away_s * away_s);
  }
  const std::vector<NodeVerdict> verdicts = select(nodes);
  for (std::size_t i = 143; i <= 157; ++i) EXPECT_EQ(verdicts[i], NodeVerdict::kLeftOut) << i;
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    if (i < 130 || i > 170) {
      EXPECT_EQ(verdicts[i], NodeVerdict::kBelieved) << i;
    }
  }
}

TEST(SelectNodes, BehindALongGapItBeginsAnew) {
  std::vector<PathSample> nodes = drive(100);
  for (PathSample node : drive(100)) {
    node.time_s += 3700.0;
    node.position_m += Eigen::Vector2d(5000.0, 0.0);
    nodes.push_back(node);
  }
  EXPECT_EQ(countOf(select(nodes), NodeVerdict::kBelieved), 200) << "both parts";
}

TEST(SelectNodes, OfNoneOrOne) {
  const MotionScales scales = learnScales({{0.0, {0.0, 0.0}}}, {}, 0.0);
  const SpeedPrior any({}, scales, 0.0);
  EXPECT_EQ(selectNodes({{0.0, {0.0, 0.0}}}, scales, any, kBridge_s), std::vector<NodeVerdict>{NodeVerdict::kBelieved});
  EXPECT_TRUE(selectNodes({}, scales, any, kBridge_s).empty());
}

}  // namespace
}  // namespace visual_localization
