// What a swarm makes of particles that match nothing, and of those that are far away.

#include <cstdint>

#include <gtest/gtest.h>

#include "localization/papers/dpso.h"
#include "test/support/synthetic.h"
#include "test/support/world.h"
#include "visual_localization/geo/trajectory.h"

namespace visual_localization {
namespace {

using test::onCircle;
using test::roundWorld;
using test::World;

TEST(SwarmEstimate, WhereNothingMatchesTheBestImageIsTheOneNearBy) {
  World world = roundWorld();
  Dpso swarm(world.map(), DpsoConfig(), 1);
  for (int image = 0; image < 40; ++image) see(swarm, world.from(onCircle(50.0)));
  const TrackerEstimate estimate = see(swarm, world.inTheDark());
  EXPECT_EQ(estimate.best.similarity, 0.0);
  EXPECT_EQ(estimate.best_image, world.map().nearest(estimate.position_m).image);
  EXPECT_EQ(estimate.training_image, estimate.best_image);
  EXPECT_GT(estimate.best_image, 0U);
}

TEST(SwarmEstimate, BeforeAnythingMatchesTheBestImageIsTheOneInTheMiddle) {
  World world = roundWorld();
  for (std::uint32_t seed = 1; seed <= 5; ++seed) {
    Dpso swarm(world.map(), DpsoConfig(), seed);
    const TrackerEstimate estimate = see(swarm, world.inTheDark());
    EXPECT_EQ(estimate.best_image, world.map().nearest(estimate.position_m).image) << seed;
  }
}

TEST(SwarmEstimate, TheCentreOfTheBestIsThatOfThoseWithAnyWeight) {
  World world = roundWorld();
  DpsoConfig config;
  config.position = "k_best";
  config.best_particles = 5;
  config.recovery = "none";
  int few = 0;
  for (std::uint32_t seed = 1; seed <= 40; ++seed) {
    Dpso swarm(world.map(), config, seed);
    const test::Seen input = world.inTheDark();
    input.scores.startImage(FeatureKind::kLocal, [&world](FeatureKind, std::size_t image) {
      return (world.map().position_m(image) - onCircle(20.0)).norm() < 2.0 ? World::scoreAt(0.3) : Score{};
    });
    const TrackerEstimate estimate = see(swarm, input);
    Eigen::Vector2d sum_m = Eigen::Vector2d::Zero();
    int weighted = 0;
    for (const Particle& particle : swarm.particles()) {
      if (particle.weight == 0.0) continue;
      sum_m += particle.position_m;
      ++weighted;
    }
    if (weighted >= config.best_particles) continue;
    EXPECT_LT((estimate.position_m - sum_m / weighted).norm(), 1e-9) << seed;
    ++few;
  }
  EXPECT_GE(few, 10);
}

TEST(SwarmEstimate, WhereNothingMatchesTheCentreOfTheBestIsTheAttractor) {
  World world = roundWorld();
  DpsoConfig config;
  config.position = "k_best";
  Dpso swarm(world.map(), config, 1);
  verify(swarm, world, onCircle(10.0));
  EXPECT_EQ(see(swarm, world.inTheDark()).position_m, onCircle(10.0));
}

/// Without smoothing; `quantum_share` of the particles are quantum ones, the others standard.
DpsoConfig withQuantumShare(double quantum_share) {
  DpsoConfig config;
  config.quantum_share = quantum_share;
  config.quantum_share_max = quantum_share;
  config.high_energy_share = 0.0;
  config.recovery = "none";
  config.ema_alpha = 1.0;
  return config;
}

/// Expects v_sw to be the speed of a point of the swarm while it follows a robot.
template <class Point>
void expectSpeedOf(const Point& point_m, World& world, Dpso& swarm) {
  for (int image = 1; image < 10; ++image) {
    const Eigen::Vector2d before_m = point_m(swarm);
    test::Seen input = world.from(onCircle(2.0 * image));
    input.motion = Motion(0.5);
    see(swarm, input);
    EXPECT_NEAR(swarm.tuning().speed_mps, (point_m(swarm) - before_m).norm() / 0.5, 1e-9) << image;
  }
}

TEST(SwarmEstimate, AResetForgetsTheSpeed) {
  World world = roundWorld();
  DpsoConfig config = withQuantumShare(0.0);
  config.ema_alpha = 0.1;
  Dpso swarm(world.map(), config, 1);
  for (int image = 0; image < 10; ++image) see(swarm, world.from(onCircle(2.0 * image)));
  swarm.reset(normallyDistributed(onCircle(0.0), 9.0 * Eigen::Matrix2d::Identity()));
  see(swarm, world.from(onCircle(0.0)));
  test::Seen input = world.from(onCircle(2.0));
  input.motion = Motion(1.0);
  see(swarm, input);
  const SwarmTuning& tuning = swarm.tuning();
  const Eigen::Vector2d area_m = world.map().area().range();
  EXPECT_GE(tuning.speed_ema * area_m.maxCoeff(), tuning.speed_mps - 1e-9);
  EXPECT_LE(tuning.speed_ema * area_m.minCoeff(), tuning.speed_mps + 1e-9);
}

TEST(SwarmEstimate, WithoutTravellersItsSpeedIsThatOfTheWeightedCentre) {
  World world = roundWorld();
  Dpso swarm(world.map(), withQuantumShare(1.0), 1);
  see(swarm, world.from(onCircle(0.0)));
  expectSpeedOf([](const Dpso& all) { return momentsOf(all.particles()).mean_m; }, world, swarm);
}

TEST(SwarmEstimate, OneTravellerIsACentre) {
  World world = roundWorld();
  DpsoConfig config = withQuantumShare(0.9);
  config.particles = 10;
  Dpso swarm(world.map(), config, 1);
  see(swarm, world.from(onCircle(0.0)));
  expectSpeedOf([](const Dpso& all) { return all.particles().back().position_m; }, world, swarm);
}

TEST(SwarmEstimate, AfterAnotherNumberOfParticlesItsSpeedIsThatOfThoseItHas) {
  World world = roundWorld();
  for (const std::size_t particles : {std::size_t{20}, std::size_t{90}}) {
    Dpso swarm(world.map(), withQuantumShare(0.0), 1);
    for (int image = 0; image < 10; ++image) see(swarm, world.from(onCircle(0.0)));
    swarm.resize(particles);
    const auto centre_m = [](const Dpso& all) {
      Eigen::Vector2d sum_m = Eigen::Vector2d::Zero();
      for (const Particle& particle : all.particles()) sum_m += particle.position_m;
      return Eigen::Vector2d(sum_m / static_cast<double>(all.particles().size()));
    };
    expectSpeedOf(centre_m, world, swarm);
  }
}

TEST(SwarmEstimate, WhereNothingConfinesItTheFrameEndsAfterAThousandKilometres) {
  World world(test::mapAt({{0.0, 0.0}, {100.0, 0.0}, {100.0, 60.0}, {0.0, 60.0}}));
  DpsoConfig config;
  config.confine = "none";
  config.recovery = "none";
  config.adapt_speed = false;
  config.phi2 = 0.6;
  config.v0 = 1e6;
  Dpso swarm(world.map(), config, 7);
  see(swarm, world.inTheDark());
  verify(swarm, world, {5e6, -5e6});
  see(swarm, world.inTheDark());
  int at_the_end = 0;
  for (const Particle& particle : swarm.particles()) {
    EXPECT_LE(particle.position_m.cwiseAbs().maxCoeff(), kLargestCoordinate_m);
    at_the_end += particle.position_m.x() == kLargestCoordinate_m ? 1 : 0;
    EXPECT_TRUE(particle.position_m.x() < kLargestCoordinate_m || particle.velocity_m.x() == 0.0);
  }
  EXPECT_GT(at_the_end, 20);
}

}  // namespace
}  // namespace visual_localization
