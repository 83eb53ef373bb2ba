#include <algorithm>
#include <stdexcept>
#include <string>
#include <tuple>

#include <gtest/gtest.h>

#include "localization/papers/dpso.h"
#include "test/support/world.h"
#include "visual_localization/localization/tracker.h"

namespace visual_localization {
namespace {

using test::onCircle;
using test::roundWorld;
using test::World;

constexpr double kStep_m = 0.6;

TrackerConfig configOf(const std::string& tracker) {
  TrackerConfig config;
  config.tracker = tracker;
  return config;
}

/// Follows a robot for `steps` images from step `begin` on; the largest error.
double follow(Tracker& tracker, World& world, int begin, int steps) {
  double largest_m = 0.0;
  for (int step = begin; step < begin + steps; ++step) {
    const Eigen::Vector2d robot = onCircle(kStep_m * step);
    largest_m = std::max(largest_m, (see(tracker, world.from(robot)).position_m - robot).norm());
  }
  return largest_m;
}

class Handover : public ::testing::TestWithParam<std::tuple<const char*, const char*>> {};

INSTANTIATE_TEST_SUITE_P(Trackers, Handover,
                         ::testing::Combine(::testing::Values("dpso", "dpso_multi", "pf_gaussian", "pf_linear"),
                                            ::testing::Values("dpso", "dpso_multi", "pf_gaussian", "pf_linear")),
                         [](const auto& pair) {
                           return std::string(std::get<0>(pair.param)) + "_to_" + std::get<1>(pair.param);
                         });

TEST_P(Handover, TheTrackGoesOnWithAnotherTrackerOrFewerParticles) {
  World world = roundWorld();
  const auto before = makeTracker(world.map(), configOf(std::get<0>(GetParam())), 1);
  follow(*before, world, 0, 80);
  TrackerConfig config = configOf(std::get<1>(GetParam()));
  config.dpso.particles = 40;
  config.pf.particles = 150;
  const auto after = makeTracker(world.map(), config, 1);
  after->reset(drawnFrom(before->particles()));
  EXPECT_EQ(after->particles().size(), config.tracker.rfind("dpso", 0) == 0 ? 40U : 150U);
  EXPECT_LT(follow(*after, world, 80, 40), 6.0);
}

class Configure : public ::testing::TestWithParam<const char*> {};

INSTANTIATE_TEST_SUITE_P(Trackers, Configure, ::testing::Values("dpso", "dpso_multi", "pf_gaussian", "pf_linear"),
                         [](const auto& tracker) { return std::string(tracker.param); });

TEST_P(Configure, TheSameParametersChangeNothing) {
  World world = roundWorld();
  const TrackerConfig config = configOf(GetParam());
  const auto left_alone = makeTracker(world.map(), config, 1);
  const auto configured = makeTracker(world.map(), config, 1);
  for (int step = 0; step < 40; ++step) {
    configured->configure(config);
    const auto seen = [&] { return step % 10 > 5 ? world.inTheDark() : world.from(onCircle(kStep_m * step)); };
    EXPECT_EQ(see(*left_alone, seen()).position_m, see(*configured, seen()).position_m);
  }
}

TEST_P(Configure, OtherParametersLeaveTheParticlesWhereTheyAre) {
  World world = roundWorld();
  TrackerConfig config = configOf(GetParam());
  const auto tracker = makeTracker(world.map(), config, 1);
  follow(*tracker, world, 0, 60);
  const auto before = tracker->particles();
  config.dpso.inertia = 0.5;
  config.pf.pull = 0.5;
  EXPECT_TRUE(tracker->configure(config));
  ASSERT_EQ(tracker->particles().size(), before.size());
  for (std::size_t i = 0; i < before.size(); ++i) EXPECT_EQ(tracker->particles()[i].position_m, before[i].position_m);
  EXPECT_LT(follow(*tracker, world, 60, 20), 6.0);
}

TEST(ConfigureDpso, WhatHasAdaptedItselfStaysUnlessJustThatIsChanged) {
  World world = roundWorld();
  TrackerConfig config = configOf("dpso");
  Dpso tracker(world.map(), config, 1);
  follow(tracker, world, 0, 100);
  const double v0 = tracker.tuning().v0;
  ASSERT_NE(v0, config.dpso.v0);
  config.dpso.phi2 = 0.4;
  tracker.configure(config);
  EXPECT_EQ(tracker.tuning().v0, v0);
  EXPECT_EQ(tracker.tuning().phi2, 0.4);
  config.dpso.v0 = 0.02;
  tracker.configure(config);
  EXPECT_EQ(tracker.tuning().v0, 0.02);
}

TEST(ConfigureDpso, SwitchingRecoveryOffEndsIt) {
  World world = roundWorld();
  TrackerConfig config = configOf("dpso");
  Dpso tracker(world.map(), config, 1);
  for (int step = 0; step < 10; ++step) see(tracker, world.inTheDark());
  ASSERT_TRUE(tracker.tuning().recovering);
  config.dpso.recovery = "none";
  tracker.configure(config);
  see(tracker, world.inTheDark());
  EXPECT_FALSE(tracker.tuning().recovering);
  EXPECT_LE(tracker.tuning().quantum_share, config.dpso.quantum_share);
}

TEST(DrawnFrom, TheBestAndTheRivalsAreAmongTheDraws) {
  std::vector<Particle> cloud(10);
  for (std::size_t i = 0; i < cloud.size(); ++i) cloud[i].position_m.x() = static_cast<double>(i);
  cloud[7].weight = 3.0;
  const Prior prior = drawnFrom(cloud);
  Random random(1);
  std::vector<int> counts(cloud.size());
  for (int i = 0; i < 10000; ++i) ++counts[static_cast<std::size_t>(prior(random).x())];
  for (std::size_t i = 0; i < counts.size(); ++i) EXPECT_NEAR(counts[i], i == 7 ? 5500 : 500, 150);
}

// Half by weight, half all alike; weights need not sum to one.
TEST(DrawnFrom, HalfOfTheDrawsAreByWeight) {
  std::vector<Particle> cloud(3);
  for (std::size_t i = 0; i < 3; ++i) cloud[i].position_m = {static_cast<double>(i), 0.0};
  cloud[0].weight = 0.08;
  cloud[1].weight = 0.02;
  const Prior prior = drawnFrom(cloud);
  Random random(3);
  std::vector<double> shares(3, 0.0);
  for (int i = 0; i < 20000; ++i) shares[static_cast<std::size_t>(prior(random).x())] += 1.0 / 20000.0;
  EXPECT_NEAR(shares[0], 0.5 * 0.8 + 0.5 / 3.0, 0.02);
  EXPECT_NEAR(shares[1], 0.5 * 0.2 + 0.5 / 3.0, 0.02);
  EXPECT_NEAR(shares[2], 0.5 / 3.0, 0.02);
}

TEST(DrawnFrom, WithoutWeightsAllAreAlikeAndWithoutParticlesThereIsNoPrior) {
  Random random(1);
  EXPECT_TRUE(drawnFrom(std::vector<Particle>(3))(random).allFinite());
  EXPECT_THROW(drawnFrom({}), std::invalid_argument);
}

}  // namespace
}  // namespace visual_localization
