#include "geo/speed_prior.h"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

namespace visual_localization {
namespace {

/// Along the x axis, a node a second, by the speed in each.
std::vector<PathSample> atSpeeds(const std::vector<double>& speeds_mps) {
  std::vector<PathSample> nodes{{0.0, {0.0, 0.0}}};
  for (const double speed_mps : speeds_mps) {
    nodes.push_back({nodes.back().time_s + 1.0, nodes.back().position_m + Eigen::Vector2d(speed_mps, 0.0)});
  }
  return nodes;
}

MotionScales scales(double usual_mps) {
  MotionScales found;
  found.usual_mps = usual_mps;
  found.noise_m = 0.05;
  return found;
}

std::vector<double> carAt(int seconds) {
  std::vector<double> speeds_mps;
  for (int i = 0; i < seconds; ++i) speeds_mps.push_back(8.0 + 5.0 * std::sin(i / 20.0));
  return speeds_mps;
}

TEST(SpeedPrior, ARobotOfConstantSpeedIsOne) {
  const SpeedPrior prior(atSpeeds(std::vector<double>(100, 0.65)), scales(0.65), 0.0);
  ASSERT_TRUE(prior.isConstant());
  EXPECT_NEAR(prior.cost(0.65), 0.0, 1e-9);
  EXPECT_NEAR(prior.cost(0.65 * 1.1), 2.0, 1e-6) << "two sigmas of the least tolerance";
  EXPECT_NEAR(prior.cost(0.65 * 0.9), 2.0, 1e-6);
  EXPECT_LE(prior.cost(0.0), 0.5) << "it may stand";
}

TEST(SpeedPrior, AFewBendsOfTheReceiverDoNotHideAConstantSpeed) {
  std::vector<double> speeds_mps(200, 0.65);
  for (std::size_t i = 50; i < 65; ++i) speeds_mps[i] = 1.2;
  for (std::size_t i = 65; i < 80; ++i) speeds_mps[i] = 0.3;
  const SpeedPrior prior(atSpeeds(speeds_mps), scales(0.65), 0.0);
  ASSERT_TRUE(prior.isConstant());
  EXPECT_GT(prior.cost(1.2), 10.0);
}

TEST(SpeedPrior, ACarIsNot) { EXPECT_FALSE(SpeedPrior(atSpeeds(carAt(300)), scales(8.0), 0.0).isConstant()); }

TEST(SpeedPrior, WhoVariesIsNot) {
  const std::vector<PathSample> nodes = atSpeeds(std::vector<double>(100, 0.65));
  EXPECT_FALSE(SpeedPrior(nodes, scales(0.65), 0.0, true).isConstant());
  EXPECT_TRUE(SpeedPrior(nodes, scales(0.65), 0.05, true).isConstant()) << "who says so is believed";
}

TEST(SpeedPrior, WhoStopsMayDriveAtConstantSpeed) {
  std::vector<double> speeds_mps(200, 0.65);
  for (std::size_t i = 60; i < 140; ++i) speeds_mps[i] = 0.0;
  const SpeedPrior prior(atSpeeds(speeds_mps), scales(0.65), 0.0);
  ASSERT_TRUE(prior.isConstant());
  EXPECT_GT(prior.cost(1.0), 10.0);
  EXPECT_NEAR(prior.cost(0.3), 4.0, 1e-9) << "it slows down and sets off";
}

TEST(SpeedPrior, WhoSaysThatTheSpeedIsConstantIsBelieved) {
  const SpeedPrior prior(atSpeeds(carAt(300)), scales(8.0), 0.1);
  ASSERT_TRUE(prior.isConstant());
  for (const double speed_mps : {4.0, 12.0}) EXPECT_GT(prior.cost(speed_mps), 2.0) << speed_mps;
}

TEST(SpeedPrior, UsualSpeedsCostNothingAndOthersABoundedAmount) {
  const SpeedPrior prior(atSpeeds(carAt(600)), scales(8.0), 0.0);
  for (const double speed_mps : {4.0, 8.0, 12.5}) EXPECT_LT(prior.cost(speed_mps), 0.3) << speed_mps;
  EXPECT_NEAR(prior.cost(25.0), 8.0, 1e-9);
  EXPECT_NEAR(prior.cost(1e6), 8.0, 1e-9);
  EXPECT_EQ(prior.cost(0.5), 0.0) << "it may stand";
}

TEST(SpeedPrior, OfAFewNodesAllSpeedsAreAsUsual) {
  const SpeedPrior prior(atSpeeds({1.0, 1.0, 1.0, 1.0, 1.0}), scales(1.0), 0.0);
  EXPECT_FALSE(prior.isConstant());
  EXPECT_EQ(prior.cost(100.0), 0.0);
  EXPECT_FALSE(SpeedPrior({}, scales(1.0), 0.0).isConstant());
}

}  // namespace
}  // namespace visual_localization
