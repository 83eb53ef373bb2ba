// How a swarm recovers, and what a restart or an attraction makes it forget.

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "base/numbers.h"
#include "localization/papers/dpso.h"
#include "test/support/world.h"

namespace visual_localization {
namespace {

using test::countOf;
using test::onCircle;
using test::roundWorld;
using test::World;

TEST(DpsoRecovery, ABadMatchStartsRecoveryAndAGoodOneEndsIt) {
  World world = roundWorld();
  DpsoConfig config;
  Dpso tracker(world.map(), config, 1);
  for (int step = 0; step < 60; ++step) see(tracker, world.from(onCircle(0.0)));
  EXPECT_FALSE(tracker.tuning().recovering);
  for (int step = 0; step < config.recovery_patience - 1; ++step) see(tracker, world.inTheDark());
  EXPECT_FALSE(tracker.tuning().recovering);
  for (int step = 0; step < 10; ++step) see(tracker, world.inTheDark());
  EXPECT_TRUE(tracker.tuning().recovering);
  EXPECT_DOUBLE_EQ(tracker.tuning().v0, config.v0_max);
  EXPECT_DOUBLE_EQ(tracker.tuning().quantum_share, config.quantum_share_max);
  EXPECT_DOUBLE_EQ(tracker.tuning().phi2, config.phi2_min);
  EXPECT_EQ(countOf(tracker.particles(), ParticleKind::kQuantum), 16u);
  for (int step = 0; step < 60 && tracker.tuning().recovering; ++step) see(tracker, world.from(onCircle(0.0)));
  EXPECT_FALSE(tracker.tuning().recovering);
  EXPECT_DOUBLE_EQ(tracker.tuning().quantum_share, config.quantum_share);
  EXPECT_DOUBLE_EQ(tracker.tuning().phi2, config.phi2);
}

TEST(DpsoRecovery, FindsAKidnappedRobotAgain) {
  World world = roundWorld();
  Dpso tracker(world.map(), DpsoConfig(), 1);
  for (int step = 0; step < 60; ++step) see(tracker, world.from(onCircle(0.6 * step)));
  const Eigen::Vector2d robot = onCircle(30.0 * kPi);  // stands where the swarm does not happen to pass by
  double error_m = 1e9;
  for (int image = 0; image < 100 && error_m > 3.0; ++image) {
    error_m = (see(tracker, world.from(robot)).position_m - robot).norm();
  }
  EXPECT_LT(error_m, 3.0);
}

TEST(DpsoRecovery, ASwarmThatHasRecognisedNothingSearches) {
  World world = roundWorld();
  Dpso tracker(world.map(), DpsoConfig(), 1);
  see(tracker, world.inTheDark());
  const std::vector<Particle> before = tracker.particles();
  for (int step = 0; step < 10; ++step) see(tracker, world.inTheDark());
  std::size_t moved = 0;
  for (std::size_t i = 0; i < before.size(); ++i) {
    moved += (tracker.particles()[i].position_m - before[i].position_m).norm() > 1.0 ? 1 : 0;
  }
  EXPECT_GT(moved, 60u);
}

TEST(DpsoRecovery, AWrongInitialPoseIsNotTerminal) {
  World world = roundWorld();
  Dpso tracker(world.map(), DpsoConfig(), 1);
  tracker.reset(normallyDistributed(onCircle(0.0), Eigen::Matrix2d::Zero()));
  const Eigen::Vector2d robot = onCircle(30.0 * kPi);
  double error_m = 1e9;
  for (int step = 0; step < 100 && error_m > 3.0; ++step) {
    error_m = (see(tracker, world.from(robot)).position_m - robot).norm();
  }
  EXPECT_LT(error_m, 3.0);
}

TEST(DpsoRecovery, ARestartForgetsTheSpeedBefore) {
  World world = roundWorld();
  Dpso swarm(world.map(), DpsoConfig(), 1);
  for (int image = 0; image < 100; ++image) see(swarm, world.from(onCircle(0.2 * image)));
  ASSERT_LT(swarm.tuning().v0, DpsoConfig().v0);
  swarm.reset(around(onCircle(50.0), 3.0));
  EXPECT_EQ(swarm.tuning().v0, DpsoConfig().v0);
  EXPECT_EQ(swarm.tuning().speed_ema, 0.0);
  for (const Particle& particle : swarm.particles()) EXPECT_EQ(particle.weight, 1.0 / 80.0);
  const std::vector<Particle> start = swarm.particles();
  see(swarm, world.inTheDark());
  for (std::size_t i = 0; i < start.size(); ++i) {
    EXPECT_EQ(swarm.particles()[i].position_m, start[i].position_m) << "the first image moves nothing";
  }
  EXPECT_EQ(swarm.tuning().speed_ema, 0.0) << "one image has no speed";
}

TEST(DpsoRecovery, ARestartForgetsWhereItWas) {
  World world = roundWorld();
  DpsoConfig config;
  config.recovery = "none";
  config.quantum_std = 0.0;
  config.quantum_share = 0.5;
  Dpso swarm(world.map(), config, 1);
  for (int image = 0; image < 20; ++image) see(swarm, world.from(onCircle(0.0)));
  swarm.reset(anywhere(world.map().area()));
  for (int image = 0; image < 3; ++image) see(swarm, world.inTheDark());
  double farthest_m = 0.0;
  for (const Particle& particle : swarm.particles()) {
    if (particle.kind != ParticleKind::kQuantum) continue;
    farthest_m = std::max(farthest_m, (particle.position_m - onCircle(0.0)).norm());
  }
  EXPECT_GT(farthest_m, 30.0) << "quantum particles of a swarm without a best one are anywhere";
}

TEST(DpsoRecovery, ABadImageBeforeARestartOrAnAttractionDoesNotCountAfterIt) {
  World world = roundWorld();
  DpsoConfig config;
  config.recovery_patience = 3;
  for (const bool restart : {true, false}) {
    Dpso swarm(world.map(), config, 1);
    for (int image = 0; image < 2; ++image) see(swarm, world.inTheDark());
    restart ? swarm.reset(around(onCircle(0.0), 3.0)) : verify(swarm, world, onCircle(10.0));
    for (int image = 0; image < 2; ++image) see(swarm, world.inTheDark());
    EXPECT_FALSE(swarm.tuning().recovering) << restart;
    see(swarm, world.inTheDark());
    EXPECT_TRUE(swarm.tuning().recovering) << restart;
  }
}

TEST(DpsoRecovery, AVerifiedPositionEndsARecoveryAndItsCount) {
  World world = roundWorld();
  DpsoConfig config;
  config.recovery_patience = 3;
  Dpso swarm(world.map(), config, 1);
  for (int image = 0; image < 5; ++image) see(swarm, world.inTheDark());
  ASSERT_TRUE(swarm.tuning().recovering);
  verify(swarm, world, onCircle(10.0));
  EXPECT_FALSE(swarm.tuning().recovering);
  EXPECT_EQ(swarm.tuning().quantum_share, config.quantum_share);
  EXPECT_EQ(swarm.tuning().v0, config.v0);
  for (int image = 0; image < 2; ++image) see(swarm, world.inTheDark());
  EXPECT_FALSE(swarm.tuning().recovering) << "the count began anew";
  see(swarm, world.inTheDark());
  EXPECT_TRUE(swarm.tuning().recovering);
}

TEST(DpsoRecovery, WhoIsAttractedSearchesThereAndNotAllOver) {
  World world = roundWorld();
  Dpso swarm(world.map(), DpsoConfig(), 1);
  for (int image = 0; image < 5; ++image) {
    verify(swarm, world, onCircle(10.0));
    see(swarm, world.inTheDark());
    if (image == 0) continue;  // which moves nothing
    for (const Particle& particle : swarm.particles()) {
      if (particle.kind != ParticleKind::kQuantum) continue;
      EXPECT_LT((particle.position_m - onCircle(10.0)).norm(), 6.0 * DpsoConfig().quantum_std * 60.0);
    }
  }
}

TEST(DpsoRecovery, RecoveryThatIsSwitchedOnAgainCountsAnew) {
  World world = roundWorld();
  TrackerConfig config;
  Dpso swarm(world.map(), config.dpso, 1);
  for (int image = 0; image < 5; ++image) see(swarm, world.inTheDark());
  ASSERT_TRUE(swarm.tuning().recovering);
  const std::string recovery = std::exchange(config.dpso.recovery, "none");
  swarm.configure(config);
  EXPECT_FALSE(swarm.tuning().recovering);
  config.dpso.recovery = recovery;
  swarm.configure(config);
  see(swarm, world.inTheDark());
  EXPECT_FALSE(swarm.tuning().recovering) << "the first bad image of two";
  see(swarm, world.inTheDark());
  EXPECT_TRUE(swarm.tuning().recovering);
}

}  // namespace
}  // namespace visual_localization
