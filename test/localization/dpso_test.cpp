#include "localization/papers/dpso.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <gtest/gtest.h>

#include "base/numbers.h"
#include "test/support/synthetic.h"
#include "test/support/world.h"
#include "visual_localization/parameters/parameters.h"

namespace visual_localization {
namespace {

using test::countOf;
using test::onCircle;
using test::roundWorld;
using test::World;

TEST(Dpso, FindsAndFollowsARobot) {
  World world = roundWorld();
  Dpso tracker(world.map(), DpsoConfig(), 1);
  double error_sum_m = 0.0;
  for (int step = 0; step < 200; ++step) {
    const Eigen::Vector2d robot = onCircle(0.6 * step);
    const TrackerEstimate estimate = see(tracker, world.from(robot));
    if (step >= 60) error_sum_m += (estimate.position_m - robot).norm();
  }
  EXPECT_LT(error_sum_m / 140.0, 1.5);
}

TEST(Dpso, ParticlesStayInTheArea) {
  World world = roundWorld();
  Dpso tracker(world.map(), DpsoConfig(), 2);
  const Area& area = world.map().area();
  for (int step = 0; step < 50; ++step) {
    see(tracker, step % 10 == 9 ? world.inTheDark() : world.from(onCircle(4.0 * step)));  // all around
    for (const Particle& particle : tracker.particles()) {
      ASSERT_TRUE((particle.position_m.array() >= area.min_m.array()).all());
      ASSERT_TRUE((particle.position_m.array() <= area.max_m.array()).all());
    }
  }
}

TEST(Dpso, TheSharesOfTheKindsAreKept) {
  World world = roundWorld();
  Dpso tracker(world.map(), DpsoConfig(), 1);
  EXPECT_EQ(countOf(tracker.particles(), ParticleKind::kQuantum), 8u);
  EXPECT_EQ(countOf(tracker.particles(), ParticleKind::kHighEnergy), 8u);
  EXPECT_EQ(countOf(tracker.particles(), ParticleKind::kStandard), 64u);
}

TEST(Dpso, NobodyFliesFasterThanAllowed) {
  World world = roundWorld();
  DpsoConfig config;
  config.adapt_speed = false;
  Dpso tracker(world.map(), config, 5);
  const Eigen::Vector2d range = world.map().area().range();
  for (int step = 0; step < 40; ++step) {
    see(tracker, world.from(onCircle(0.6 * step)));
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
  const Dpso swarm(*city, DpsoConfig(), 1);
  double fastest_m = 0.0;
  for (const Particle& particle : swarm.particles()) {
    fastest_m = std::max(fastest_m, particle.velocity_m.cwiseAbs().maxCoeff());
  }
  EXPECT_LE(fastest_m, 0.015 * 500.0);
  EXPECT_GT(fastest_m, 0.9 * 0.015 * 500.0);
}

TEST(Dpso, AStraightStreetHasNoSecondAxis) {
  World world(test::mapAt(test::street(50, 2.0)));
  Dpso tracker(world.map(), DpsoConfig(), 1);
  TrackerEstimate estimate;
  for (int step = 0; step < 40; ++step) estimate = see(tracker, world.from({20.0 + 0.6 * step, 0.0}));
  EXPECT_NEAR(estimate.position_m.x(), 20.0 + 0.6 * 39, 3.0);
  EXPECT_EQ(estimate.position_m.y(), 0.0);
  EXPECT_TRUE(estimate.mode_covariance_m2.allFinite());
  EXPECT_TRUE(std::isfinite(tracker.tuning().v0));
}

TEST(Dpso, AnAxisOfDecimetresIsOne) {
  World world(test::mapAt({{0.0, 0.0}, {20.0, 0.0}, {20.0, 0.5}, {0.0, 0.5}}));
  DpsoConfig config;
  config.quantum_share = 0.0;
  config.speed_limit = "norm";
  Dpso swarm(world.map(), config, 1);
  for (int image = 0; image < 3; ++image) see(swarm, world.inTheDark());
  const auto moves = [](const Particle& particle) { return particle.velocity_m.y() != 0.0; };
  EXPECT_TRUE(std::any_of(swarm.particles().begin(), swarm.particles().end(), moves));
}

TEST(Dpso, AMapOfOneImageWorks) {
  World world(test::mapAt({{3.0, 4.0}}));
  Dpso tracker(world.map(), DpsoConfig(), 1);
  for (int step = 0; step < 5; ++step) {
    const TrackerEstimate estimate = see(tracker, world.from({3.0, 4.0}));
    EXPECT_EQ(estimate.position_m, Eigen::Vector2d(3.0, 4.0));
  }
}

TEST(Dpso, SpeedLimitFollowsTheRobot) {
  World world = roundWorld();
  DpsoConfig config;
  config.recovery = "none";
  Dpso tracker(world.map(), config, 1);
  for (int step = 0; step < 150; ++step) see(tracker, world.from(onCircle(0.3 * step)));
  const double slow = tracker.tuning().v0;
  for (int step = 0; step < 150; ++step) see(tracker, world.from(onCircle(45.0 + 1.5 * step)));
  const double fast = tracker.tuning().v0;
  EXPECT_GT(fast, 1.5 * slow);
  EXPECT_LE(fast, config.v0_max);
  EXPECT_GE(slow, config.v0_min);
}

TEST(Dpso, AnImageThatMatchesNothingMovesNoEstimate) {
  World world = roundWorld();
  Dpso tracker(world.map(), DpsoConfig(), 1);
  for (int step = 0; step < 60; ++step) see(tracker, world.from(onCircle(0.0)));
  const Eigen::Vector2d before = see(tracker, world.from(onCircle(0.0))).position_m;
  EXPECT_EQ(see(tracker, world.inTheDark()).position_m, before);
}

TEST(Dpso, ASingleFalseMatchDoesNotHideHowFarTheSearchReaches) {
  World world = roundWorld();
  Dpso tracker(world.map(), DpsoConfig(), 1);
  const test::Seen input = world.inTheDark();
  bool given = false;
  input.scores.startImage(FeatureKind::kLocal, [&given](FeatureKind, std::size_t) {
    return std::exchange(given, true) ? Score{} : World::scoreAt(0.01);
  });
  const TrackerEstimate estimate = see(tracker, input);
  EXPECT_GT(estimate.cloud_covariance_m2.trace(), 400.0);
}

TEST(Dpso, CountsAtMostOneComparisonAParticle) {
  World world = roundWorld();
  DpsoConfig config;
  config.particles = 30;
  Dpso tracker(world.map(), config, 1);
  for (int step = 0; step < 20; ++step) {
    const test::Seen input = world.from(onCircle(0.6 * step));
    see(tracker, input);
    EXPECT_LE(input.scores.comparisons(), 30u);
    EXPECT_GE(input.scores.comparisons(), 1u);
  }
}

TEST(Dpso, AnotherNumberOfParticlesHasTheSameShares) {
  World world = roundWorld();
  Dpso swarm(world.map(), DpsoConfig(), 1);
  for (const std::size_t particles : {40U, 120U}) {
    swarm.resize(particles);
    EXPECT_EQ(countOf(swarm.particles(), ParticleKind::kQuantum), particles / 10);
    EXPECT_EQ(countOf(swarm.particles(), ParticleKind::kHighEnergy), particles / 10);
    EXPECT_EQ(countOf(swarm.particles(), ParticleKind::kStandard), particles * 8 / 10);
    EXPECT_NEAR(test::sumOfWeights(swarm.particles()), 1.0, 1e-9);
  }
}

TEST(Dpso, StaysOutOfExcludedPlacesUnlessItsBestParticleIsThere) {
  World world = roundWorld();
  const Eigen::Vector2d here_m(30.0, 0.0);
  const auto nearest_m = [&](const Eigen::Vector2d& place_m, const Eigen::Vector2d& attractor_m) {
    Dpso swarm(world.map(), DpsoConfig(), 1);
    swarm.exclude({place_m}, 15.0);
    verify(swarm, world, attractor_m);
    see(swarm, world.inTheDark());  // the particles are all over the area
    double least_m = 1e9;
    for (const Particle& p : swarm.particles()) least_m = std::min(least_m, (p.position_m - place_m).norm());
    return least_m;
  };
  EXPECT_GE(nearest_m(-here_m, here_m), 15.0);
  EXPECT_GE(nearest_m(here_m, Eigen::Vector2d(14.9, 0.0)), 15.0);
  EXPECT_LT(nearest_m(here_m, Eigen::Vector2d(15.1, 0.0)), 15.0);
}

TEST(Dpso, AVerifiedPositionIsTheEstimateAndComparesNothing) {
  World world = roundWorld();
  Dpso swarm(world.map(), DpsoConfig(), 1);
  see(swarm, world.inTheDark());
  test::Seen input = world.from(onCircle(100.0));
  input.verified_m = onCircle(10.0);
  see(swarm, input);
  EXPECT_EQ(input.scores.comparisons(), 0U);
  for (int image = 0; image < 10; ++image) {
    test::Seen next = world.from(onCircle(100.0));
    next.verified_m = onCircle(10.0);
    const TrackerEstimate estimate = see(swarm, next);
    EXPECT_EQ(estimate.position_m, onCircle(10.0));
    EXPECT_FALSE(estimate.recovering);
  }
}

TEST(Dpso, TheEstimateNamesItsTrainingImages) {
  World world = roundWorld();
  Dpso swarm(world.map(), DpsoConfig(), 1);
  for (int image = 0; image < 40; ++image) {
    const test::Seen input = world.from(onCircle(0.6 * image));
    const TrackerEstimate estimate = see(swarm, input);
    EXPECT_EQ(estimate.training_image, world.map().nearest(estimate.position_m).image);
    if (estimate.best.similarity == 0.0) continue;
    EXPECT_EQ(estimate.best_image, input.scores.mostSimilar().front());
    EXPECT_EQ(estimate.best.similarity, input.scores[estimate.best_image].similarity);
    EXPECT_NEAR(estimate.best_distance_m, (world.map().position_m(estimate.best_image) - estimate.position_m).norm(),
                1e-12);
  }
}

TEST(Dpso, AShareOfTheParticlesMovesWithTheOdometryAndTheSpeedIsWithoutIt) {
  World world(test::mapAt(test::street(100, 1.0)));
  for (const double share : {0.0, 0.5, 1.0}) {
    DpsoConfig config;
    config.inertia = 0.0;
    config.phi0 = 0.0;
    config.phi2 = 0.0;
    config.quantum_share = 0.0;
    config.recovery = "none";
    OdometryConfig odometry;
    odometry.share = share;
    Dpso swarm(world.map(), config, 1);
    swarm.reset(around({50.0, 0.0}, 5.0));
    see(swarm, world.inTheDark());
    see(swarm, world.inTheDark());
    const std::vector<Particle> before = swarm.particles();
    test::Seen input = world.inTheDark();
    input.motion = Motion(2.0, OdometryIncrement{{3.0, 0.0}, 0.0, 3.0}, odometry);
    see(swarm, input);
    int moved = 0;
    for (std::size_t i = 0; i < before.size(); ++i) {
      const double way_m = (swarm.particles()[i].position_m - before[i].position_m).x();
      EXPECT_TRUE(way_m == 0.0 || std::abs(way_m - 3.0) < 1e-9) << way_m;
      moved += way_m > 1.0 ? 1 : 0;
    }
    EXPECT_NEAR(moved, share * 80.0, share == 0.5 ? 10.0 : 0.0);
    EXPECT_NEAR(swarm.tuning().speed_ema, 0.0, 1e-12) << "the swarm itself did not move";
    EXPECT_NEAR(swarm.tuning().speed_mps, 1.5 * share, share == 0.5 ? 0.3 : 1e-9) << "over the ground it did";
  }
}

TEST(Dpso, AReconfigurationChangesWhatItNames) {
  World world = roundWorld();
  TrackerConfig config;
  Dpso swarm(world.map(), config.dpso, 1);
  for (int image = 0; image < 60; ++image) see(swarm, world.from(onCircle(0.2 * image)));
  const double adapted = swarm.tuning().v0;
  ASSERT_LT(adapted, 0.010);
  config.dpso.recovery = "none";
  swarm.configure(config);
  EXPECT_EQ(swarm.tuning().v0, adapted) << "there was no recovery to end";
  config.dpso.phi0 = 0.7;
  config.dpso.phi2 = 0.4;
  swarm.configure(config);
  EXPECT_EQ(swarm.tuning().phi0, 0.7);
  EXPECT_EQ(swarm.tuning().phi2, 0.4);
  config.dpso.v0_min = 0.012;
  swarm.configure(config);
  EXPECT_EQ(swarm.tuning().v0, 0.012);
  config.dpso.v0_min = 0.001;
  config.dpso.v0_max = 0.002;
  swarm.configure(config);
  EXPECT_EQ(swarm.tuning().v0, 0.002);
}

TEST(Dpso, AReconfigurationChangesWhatConfinesIt) {
  World world = roundWorld();
  TrackerConfig config;
  config.dpso.confine = "none";
  config.dpso.phi0 = 5.0;
  Dpso swarm(world.map(), config.dpso, 1);
  const auto isAnyOutside = [&] {
    bool outside = false;
    for (int image = 0; image < 20; ++image) {
      see(swarm, world.inTheDark());
      for (const Particle& particle : swarm.particles()) {
        outside = outside || (particle.position_m.array().abs() > 30.0 + 1e-6).any();
      }
    }
    return outside;
  };
  EXPECT_TRUE(isAnyOutside());
  config.dpso.confine = "box";
  swarm.configure(config);
  EXPECT_FALSE(isAnyOutside());
}

TEST(Dpso, AParticleThatTheCorridorHoldsKeepsOnlyTheSpeedAlongIt) {
  World world(test::mapAt(test::street(101, 1.0)));
  DpsoConfig config;
  config.confine = "corridor";
  config.corridor_m = 2.0;
  config.inertia = 1.0;
  config.phi0 = 0.0;
  config.phi2 = 0.0;
  config.quantum_share = 0.0;
  config.recovery = "none";
  Dpso swarm(world.map(), config, 1);
  swarm.reset(around({100.0, 0.0}, 0.5));  // the end of the street
  for (int image = 0; image < 20; ++image) see(swarm, world.inTheDark());
  int held = 0;
  for (const Particle& particle : swarm.particles()) {
    const Eigen::Vector2d end_m(100.0, 0.0);
    if ((particle.position_m - end_m).norm() < 2.0 - 1e-9 || particle.position_m.x() < 100.0) continue;
    EXPECT_LE(particle.velocity_m.dot(particle.position_m - end_m), 1e-9);
    ++held;
  }
  EXPECT_GT(held, 10);
}

TEST(Dpso, InsideTheCorridorNobodyIsHeld) {
  World world(test::mapAt({{50.0, 20.0}}));
  DpsoConfig config;
  config.confine = "corridor";
  config.corridor_m = 2.0;
  config.phi0 = 0.0;
  config.recovery = "none";
  config.quantum_share = 0.0;
  Dpso swarm(world.map(), config, 1);
  swarm.reset(around({50.0, 20.0}, 0.3));
  const std::vector<Particle> before = swarm.particles();
  see(swarm, world.inTheDark());
  for (std::size_t i = 0; i < before.size(); ++i) {
    const Eigen::Vector2d expected_m = before[i].position_m + swarm.particles()[i].velocity_m;
    EXPECT_LT((swarm.particles()[i].position_m - expected_m).norm(), 1e-9) << i;
  }
}

TEST(Dpso, BeforeTheFirstImageThereIsNoWay) {
  World world(test::mapAt(test::street(100, 1.0)));
  OdometryConfig odometry;
  odometry.share = 1.0;
  Dpso swarm(world.map(), DpsoConfig(), 1);
  swarm.reset(around({50.0, 0.0}, 5.0));
  const std::vector<Particle> before = swarm.particles();
  test::Seen input = world.inTheDark();
  input.motion = Motion(0.0, OdometryIncrement{{30.0, 0.0}, 0.0, 30.0}, odometry);
  see(swarm, input);
  for (std::size_t i = 0; i < before.size(); ++i) {
    EXPECT_EQ(swarm.particles()[i].position_m, before[i].position_m);
  }
}

TEST(Dpso, TheAttractorMovesWithTheOdometry) {
  World world(test::mapAt(test::street(100, 1.0)));
  DpsoConfig config;
  config.quantum_std = 0.0;
  config.recovery = "none";
  Dpso swarm(world.map(), config, 1);
  swarm.reset(around({50.0, 0.0}, 5.0));
  see(swarm, world.inTheDark());
  verify(swarm, world, {50.0, 0.0});
  test::Seen input = world.inTheDark();
  input.motion = Motion(0.0, OdometryIncrement{{3.0, 0.0}, 0.0, 3.0});
  EXPECT_EQ(see(swarm, input).position_m, Eigen::Vector2d(53.0, 0.0));
  EXPECT_EQ(swarm.particles().front().position_m, Eigen::Vector2d(53.0, 0.0)) << "a quantum particle";
}

TEST(Dpso, TheCovarianceIsThatOfTheModeAroundTheEstimate) {
  World world = roundWorld();
  DpsoConfig config;
  config.mode_radius_m = 4.0;
  Dpso swarm(world.map(), config, 1);
  for (int image = 0; image < 40; ++image) {
    const TrackerEstimate estimate = see(swarm, world.from(onCircle(0.6 * image)));
    EXPECT_EQ(estimate.mode_covariance_m2, covarianceAbout(estimate.position_m, swarm.particles(), 4.0));
    EXPECT_EQ(estimate.cloud_covariance_m2, scatterAbout(estimate.position_m, swarm.particles()));
    EXPECT_EQ(estimate.spread_m, momentsOf(swarm.particles()).spread());
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
