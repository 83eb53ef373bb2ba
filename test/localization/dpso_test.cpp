#include "localization/dpso.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <gtest/gtest.h>

#include "base/angles.h"
#include "test/support/synthetic.h"
#include "test/support/world.h"
#include "visual_localization/parameters/parameters.h"

namespace visual_localization {
namespace {

using test::onCircle;
using test::roundWorld;
using test::World;

std::size_t countOf(const std::vector<Particle>& particles, ParticleKind kind) {
  return static_cast<std::size_t>(
      std::count_if(particles.begin(), particles.end(), [kind](const Particle& p) { return p.kind == kind; }));
}

TEST(Dpso, FindsAndFollowsARobot) {
  World world = roundWorld();
  Dpso tracker(world.map(), DpsoConfig(), FitnessConfig(), 1);
  double error_sum_m = 0.0;
  for (int step = 0; step < 200; ++step) {
    const Eigen::Vector2d robot = onCircle(0.6 * step);
    const TrackerEstimate estimate = tracker.update(world.from(robot));
    if (step >= 60) error_sum_m += (estimate.position_m - robot).norm();
  }
  EXPECT_LT(error_sum_m / 140.0, 1.5);
}

TEST(Dpso, ParticlesStayInTheArea) {
  World world = roundWorld();
  Dpso tracker(world.map(), DpsoConfig(), FitnessConfig(), 2);
  const Area& area = world.map().area();
  for (int step = 0; step < 50; ++step) {
    tracker.update(step % 10 == 9 ? world.inTheDark() : world.from(onCircle(0.6 * step)));
    for (const Particle& particle : tracker.particles()) {
      ASSERT_TRUE((particle.position_m.array() >= area.min_m.array()).all());
      ASSERT_TRUE((particle.position_m.array() <= area.max_m.array()).all());
    }
  }
}

TEST(Dpso, TheSharesOfTheKindsAreKept) {
  World world = roundWorld();
  Dpso tracker(world.map(), DpsoConfig(), FitnessConfig(), 1);
  EXPECT_EQ(countOf(tracker.particles(), ParticleKind::kQuantum), 8u);
  EXPECT_EQ(countOf(tracker.particles(), ParticleKind::kHighEnergy), 8u);
  EXPECT_EQ(countOf(tracker.particles(), ParticleKind::kStandard), 64u);
}

TEST(Dpso, NobodyFliesFasterThanAllowed) {
  World world = roundWorld();
  DpsoConfig config;
  config.adapt_speed = false;
  Dpso tracker(world.map(), config, FitnessConfig(), 5);
  const Eigen::Vector2d range = world.map().area().range();
  for (int step = 0; step < 40; ++step) {
    tracker.update(world.from(onCircle(0.6 * step)));
    for (const Particle& particle : tracker.particles()) {
      const double factor = particle.kind == ParticleKind::kHighEnergy ? 3.0 : 1.0;
      for (int axis = 0; axis < 2; ++axis) {
        ASSERT_LE(std::abs(particle.velocity_m[axis]), factor * config.v0 * range[axis] * (1.0 + 1e-12));
      }
    }
  }
}

TEST(Dpso, InACityItIsNotFasterThanTheLargestRangeAllows) {
  const auto city = test::mapAt(test::circle(200, 5000.0));
  const Dpso swarm(*city, DpsoConfig(), FitnessConfig(), 1);
  double fastest_m = 0.0;
  for (const Particle& particle : swarm.particles()) {
    fastest_m = std::max(fastest_m, particle.velocity_m.cwiseAbs().maxCoeff());
  }
  EXPECT_LE(fastest_m, 0.015 * 500.0);
  EXPECT_GT(fastest_m, 0.9 * 0.015 * 500.0);
}

TEST(Dpso, AStraightStreetHasNoSecondAxis) {
  World world(test::mapAt(test::street(50, 2.0)));
  Dpso tracker(world.map(), DpsoConfig(), FitnessConfig(), 1);
  TrackerEstimate estimate;
  for (int step = 0; step < 40; ++step) estimate = tracker.update(world.from({20.0 + 0.6 * step, 0.0}));
  EXPECT_NEAR(estimate.position_m.x(), 20.0 + 0.6 * 39, 3.0);
  EXPECT_EQ(estimate.position_m.y(), 0.0);
  EXPECT_TRUE(estimate.mode_covariance_m2.allFinite());
  EXPECT_TRUE(std::isfinite(tracker.tuning().v0));
}

TEST(Dpso, AMapOfOneImageWorks) {
  World world(test::mapAt({{3.0, 4.0}}));
  Dpso tracker(world.map(), DpsoConfig(), FitnessConfig(), 1);
  for (int step = 0; step < 5; ++step) {
    const TrackerEstimate estimate = tracker.update(world.from({3.0, 4.0}));
    EXPECT_EQ(estimate.position_m, Eigen::Vector2d(3.0, 4.0));
  }
}

TEST(Dpso, SpeedLimitFollowsTheRobot) {
  World world = roundWorld();
  DpsoConfig config;
  config.recovery = "none";
  Dpso tracker(world.map(), config, FitnessConfig(), 1);
  for (int step = 0; step < 150; ++step) tracker.update(world.from(onCircle(0.3 * step)));
  const double slow = tracker.tuning().v0;
  for (int step = 0; step < 150; ++step) tracker.update(world.from(onCircle(45.0 + 1.5 * step)));
  const double fast = tracker.tuning().v0;
  EXPECT_GT(fast, 1.5 * slow);
  EXPECT_LE(fast, config.v0_max);
  EXPECT_GE(slow, config.v0_min);
}

TEST(Dpso, ABadMatchStartsRecoveryAndAGoodOneEndsIt) {
  World world = roundWorld();
  DpsoConfig config;
  Dpso tracker(world.map(), config, FitnessConfig(), 1);
  for (int step = 0; step < 60; ++step) tracker.update(world.from(onCircle(0.0)));
  EXPECT_FALSE(tracker.tuning().recovering);
  for (int step = 0; step < config.recovery_patience - 1; ++step) tracker.update(world.inTheDark());
  EXPECT_FALSE(tracker.tuning().recovering);
  for (int step = 0; step < 10; ++step) tracker.update(world.inTheDark());
  EXPECT_TRUE(tracker.tuning().recovering);
  EXPECT_DOUBLE_EQ(tracker.tuning().v0, config.v0_max);
  EXPECT_DOUBLE_EQ(tracker.tuning().quantum_share, config.quantum_share_max);
  EXPECT_DOUBLE_EQ(tracker.tuning().phi2, config.phi2_min);
  EXPECT_EQ(countOf(tracker.particles(), ParticleKind::kQuantum), 16u);
  for (int step = 0; step < 60 && tracker.tuning().recovering; ++step) tracker.update(world.from(onCircle(0.0)));
  EXPECT_FALSE(tracker.tuning().recovering);
  EXPECT_DOUBLE_EQ(tracker.tuning().quantum_share, config.quantum_share);
  EXPECT_DOUBLE_EQ(tracker.tuning().phi2, config.phi2);
}

TEST(Dpso, FindsAKidnappedRobotAgain) {
  World world = roundWorld();
  Dpso tracker(world.map(), DpsoConfig(), FitnessConfig(), 1);
  for (int step = 0; step < 60; ++step) tracker.update(world.from(onCircle(0.6 * step)));
  TrackerEstimate estimate;
  int step = 60;
  const double half_m = 30.0 * kPi;
  for (; step < 260; ++step) {
    estimate = tracker.update(world.from(onCircle(half_m + 0.6 * step)));
    if ((estimate.position_m - onCircle(half_m + 0.6 * step)).norm() < 3.0) break;
  }
  EXPECT_LT(step, 260);
}

TEST(Dpso, AnImageThatMatchesNothingMovesNoEstimate) {
  World world = roundWorld();
  Dpso tracker(world.map(), DpsoConfig(), FitnessConfig(), 1);
  for (int step = 0; step < 60; ++step) tracker.update(world.from(onCircle(0.0)));
  const Eigen::Vector2d before = tracker.update(world.from(onCircle(0.0))).position_m;
  EXPECT_EQ(tracker.update(world.inTheDark()).position_m, before);
}

TEST(Dpso, ASwarmThatHasRecognisedNothingSearches) {
  World world = roundWorld();
  Dpso tracker(world.map(), DpsoConfig(), FitnessConfig(), 1);
  tracker.update(world.inTheDark());
  const std::vector<Particle> before = tracker.particles();
  for (int step = 0; step < 10; ++step) tracker.update(world.inTheDark());
  std::size_t moved = 0;
  for (std::size_t i = 0; i < before.size(); ++i) {
    moved += (tracker.particles()[i].position_m - before[i].position_m).norm() > 1.0 ? 1 : 0;
  }
  EXPECT_GT(moved, 60u);
}

TEST(Dpso, AWrongInitialPoseIsNotTerminal) {
  World world = roundWorld();
  Dpso tracker(world.map(), DpsoConfig(), FitnessConfig(), 1);
  tracker.reset(normallyDistributed(onCircle(0.0), Eigen::Matrix2d::Zero()));
  const Eigen::Vector2d robot = onCircle(30.0 * kPi);
  double error_m = 1e9;
  for (int step = 0; step < 100 && error_m > 3.0; ++step) {
    error_m = (tracker.update(world.from(robot)).position_m - robot).norm();
  }
  EXPECT_LT(error_m, 3.0);
}

TEST(Dpso, ASingleFalseMatchDoesNotHideHowFarTheSearchReaches) {
  World world = roundWorld();
  Dpso tracker(world.map(), DpsoConfig(), FitnessConfig(), 1);
  const TrackerInput input = world.inTheDark();
  bool given = false;
  input.scores.startImage(FeatureKind::kSift, [&given](FeatureKind, std::size_t) {
    return std::exchange(given, true) ? Score{} : World::scoreAt(0.01);
  });
  const TrackerEstimate estimate = tracker.update(input);
  EXPECT_GT(estimate.cloud_covariance_m2.trace(), 400.0);
}

TEST(Dpso, CountsAtMostOneComparisonAParticle) {
  World world = roundWorld();
  DpsoConfig config;
  config.particles = 30;
  Dpso tracker(world.map(), config, FitnessConfig(), 1);
  for (int step = 0; step < 20; ++step) {
    const TrackerInput input = world.from(onCircle(0.6 * step));
    tracker.update(input);
    EXPECT_LE(input.scores.comparisons(), 30u);
    EXPECT_GE(input.scores.comparisons(), 1u);
  }
}

TEST(DpsoConfig, SaysWhichConstraintIsViolated) {
  EXPECT_TRUE(violationsOf(DpsoConfig()).empty());
  DpsoConfig config;
  config.v0 = 0.5;
  config.phi2_min = 0.9;
  config.high_energy_share = 0.9;
  EXPECT_EQ(violationsOf(config).size(), 3u);
}

}  // namespace
}  // namespace visual_localization
