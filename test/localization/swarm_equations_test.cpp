// Known answers to the equations of Kronfeld et al. (journal), sections 3 and 5.

#include <algorithm>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "localization/papers/dpso.h"
#include "test/support/synthetic.h"
#include "test/support/world.h"

namespace visual_localization {
namespace {

using test::onCircle;
using test::roundWorld;
using test::World;

const Eigen::Vector2d kRange_m(100.0, 60.0);

/// Four training images at the corners of an area of that range.
World cornersWorld() { return World(test::mapAt({{0.0, 0.0}, {100.0, 0.0}, {100.0, 60.0}, {0.0, 60.0}})); }

/// A large swarm that nothing confines, limits or adapts, and of which nothing moves.
DpsoConfig stillConfig() {
  DpsoConfig config;
  config.particles = 2000;
  config.confine = "none";
  config.recovery = "none";
  config.adapt_speed = false;
  config.inertia = 0.0;
  config.phi0 = 0.0;
  config.phi2 = 0.0;
  config.v0 = 100.0;
  return config;
}

/// One move of the swarm towards `attractor_m`.
struct OneMove {
  std::vector<Particle> before;
  std::vector<Particle> after;

  OneMove(World& world, const DpsoConfig& config, const Eigen::Vector2d& attractor_m) {
    Dpso swarm(world.map(), config, 7);
    see(swarm, world.inTheDark());  // nothing moves at the first image
    verify(swarm, world, attractor_m);
    before = swarm.particles();
    see(swarm, world.inTheDark());
    after = swarm.particles();
  }

  /// Of the particles of one kind, axis by axis, what `value` makes of them before and after.
  template <class Value>
  std::vector<double> of(ParticleKind kind, const Value& value) const {
    std::vector<double> values;
    for (std::size_t i = 0; i < before.size(); ++i) {
      if (before[i].kind != kind) continue;
      for (int axis = 0; axis < 2; ++axis) values.push_back(value(before[i], after[i], axis));
    }
    return values;
  }
};

double meanOf(const std::vector<double>& values) {
  double sum = 0.0;
  for (const double value : values) sum += value;
  return sum / static_cast<double>(values.size());
}

/// Uniform between two numbers, as far as so many draws can say.
void expectUniform(const std::vector<double>& values, double least, double most) {
  ASSERT_GE(values.size(), 1000U);
  const double width = most - least;
  EXPECT_GE(*std::min_element(values.begin(), values.end()), least - 1e-9);
  EXPECT_LE(*std::min_element(values.begin(), values.end()), least + 0.01 * width);
  EXPECT_GE(*std::max_element(values.begin(), values.end()), most - 0.01 * width);
  EXPECT_LE(*std::max_element(values.begin(), values.end()), most + 1e-9);
  EXPECT_NEAR(meanOf(values), 0.5 * (least + most), 0.02 * width);
}

TEST(SwarmEquations, Eq4InertiaKeepsAShareOfTheVelocity) {
  World world = cornersWorld();
  DpsoConfig config = stillConfig();
  config.inertia = 0.5;
  const OneMove move(world, config, {50.0, 30.0});
  for (const ParticleKind kind : {ParticleKind::kStandard, ParticleKind::kHighEnergy}) {
    const std::vector<double> shares = move.of(kind, [](const Particle& before, const Particle& after, int axis) {
      return after.velocity_m[axis] / before.velocity_m[axis];
    });
    for (const double share : shares) ASSERT_NEAR(share, 0.5, 1e-12);
  }
}

TEST(SwarmEquations, Eq4AttractionIsAUniformShareOfTheWayToTheBestParticleAxisByAxis) {
  World world = cornersWorld();
  DpsoConfig config = stillConfig();
  config.phi2 = 0.6;
  const Eigen::Vector2d attractor_m(300.0, -200.0);
  const OneMove move(world, config, attractor_m);
  const std::vector<double> shares =
      move.of(ParticleKind::kStandard, [&](const Particle& before, const Particle& after, int axis) {
        return after.velocity_m[axis] / (attractor_m[axis] - before.position_m[axis]);
      });
  expectUniform(shares, 0.0, 0.6);
  double apart = 0.0;
  for (std::size_t i = 0; i + 1 < shares.size(); i += 2) apart += std::abs(shares[i] - shares[i + 1]);
  EXPECT_NEAR(apart / static_cast<double>(shares.size() / 2), 0.6 / 3.0, 0.02) << "each axis has its own r2";
}

TEST(SwarmEquations, Eq4PerturbationIsUniformInBothDirections) {
  World world = cornersWorld();
  DpsoConfig config = stillConfig();
  config.phi0 = 0.3;
  config.v0 = 0.02;
  const OneMove move(world, config, {50.0, 30.0});
  expectUniform(
      move.of(ParticleKind::kStandard, [](const Particle&, const Particle& after,
                                          int axis) { return after.velocity_m[axis] / (kRange_m[axis] * 0.02); }),
      -0.3, 0.3);
}

TEST(SwarmEquations, Eq5TheVelocityIsAddedToThePosition) {
  World world = cornersWorld();
  DpsoConfig config = stillConfig();
  config.phi0 = 0.3;
  config.phi2 = 0.6;
  config.inertia = 0.99;
  const OneMove move(world, config, {50.0, 30.0});
  const std::vector<double> left_m =
      move.of(ParticleKind::kStandard, [](const Particle& before, const Particle& after, int axis) {
        return after.position_m[axis] - before.position_m[axis] - after.velocity_m[axis];
      });
  for (const double off_m : left_m) ASSERT_NEAR(off_m, 0.0, 1e-9);
}

TEST(SwarmEquations, NoAxisIsFasterThanTheLimitAndThreeTimesThatWithHighEnergy) {
  World world = cornersWorld();
  DpsoConfig config = stillConfig();
  config.phi2 = 1.0;
  config.v0 = 0.01;
  config.high_energy_share = 0.4;
  const OneMove move(world, config, {10000.0, 10000.0});  // all are drawn farther than they may go
  const auto speed = [](const Particle&, const Particle& after, int axis) {
    return after.velocity_m[axis] / kRange_m[axis];
  };
  for (const auto& [kind, limit] :
       {std::make_pair(ParticleKind::kStandard, 0.01), std::make_pair(ParticleKind::kHighEnergy, 0.03)}) {
    std::vector<double> speeds = move.of(kind, speed);
    std::sort(speeds.begin(), speeds.end());
    EXPECT_NEAR(speeds.back(), limit, 1e-12);
    EXPECT_NEAR(speeds[speeds.size() / 10], limit, 1e-12) << "r2 is so small for one in some thousands only";
  }
}

TEST(SwarmEquations, TheLimitOfTheNormKeepsTheDirection) {
  World world = cornersWorld();
  DpsoConfig config = stillConfig();
  config.inertia = 1.0;
  config.speed_limit = "norm";
  config.v0 = 0.05;
  Dpso swarm(world.map(), config, 7);
  see(swarm, world.inTheDark());
  const std::vector<Particle> before = swarm.particles();
  TrackerConfig slower;
  slower.dpso = config;
  slower.dpso.v0 = 0.01;
  swarm.configure(slower);
  see(swarm, world.inTheDark());
  for (std::size_t i = 0; i < before.size(); ++i) {
    if (before[i].kind != ParticleKind::kStandard) continue;
    const Eigen::Vector2d share = swarm.particles()[i].velocity_m.cwiseQuotient(kRange_m);
    const Eigen::Vector2d wanted = before[i].velocity_m.cwiseQuotient(kRange_m);
    ASSERT_NEAR(share.norm(), std::min(0.01, wanted.norm()), 1e-12);
    ASSERT_NEAR(share.normalized().dot(wanted.normalized()), 1.0, 1e-12);
  }
}

TEST(SwarmEquations, Eq6QuantumParticlesSpreadNormallyAboutTheBestParticle) {
  World world = cornersWorld();
  DpsoConfig config = stillConfig();
  config.quantum_share = 0.8;
  config.quantum_std = 0.15;
  const Eigen::Vector2d attractor_m(20.0, 50.0);
  const OneMove move(world, config, attractor_m);
  const std::vector<double> offsets =
      move.of(ParticleKind::kQuantum, [&](const Particle&, const Particle& after, int axis) {
        EXPECT_EQ(after.velocity_m, Eigen::Vector2d::Zero().eval());
        return (after.position_m[axis] - attractor_m[axis]) / kRange_m[axis];
      });
  EXPECT_NEAR(meanOf(offsets), 0.0, 0.01);
  std::vector<double> squares;
  for (const double offset : offsets) squares.push_back(offset * offset);
  EXPECT_NEAR(std::sqrt(meanOf(squares)), 0.15, 0.01);
}

TEST(SwarmEquations, Eq6WithoutASpreadQuantumParticlesAreAtTheBestParticle) {
  World world = cornersWorld();
  DpsoConfig config = stillConfig();
  config.quantum_std = 0.0;
  const Eigen::Vector2d attractor_m(20.0, 50.0);
  const OneMove move(world, config, attractor_m);
  for (const double off : move.of(ParticleKind::kQuantum, [&](const Particle&, const Particle&after, int axis) {
         return after.position_m[axis] - attractor_m[axis];
       })) {
    ASSERT_EQ(off, 0.0);
  }
}

TEST(SwarmEquations, QuantumParticlesOfASwarmThatSawNothingAreAnywhere) {
  World world = cornersWorld();
  DpsoConfig config = stillConfig();
  config.quantum_share = 0.8;
  Dpso swarm(world.map(), config, 7);
  see(swarm, world.inTheDark());
  see(swarm, world.inTheDark());
  std::vector<double> shares;
  for (const Particle& particle : swarm.particles()) {
    if (particle.kind != ParticleKind::kQuantum) continue;
    for (int axis = 0; axis < 2; ++axis) shares.push_back(particle.position_m[axis] / kRange_m[axis]);
  }
  expectUniform(shares, 0.0, 1.0);
}

TEST(SwarmEquations, TheBestParticleAttractsTheNextMove) {
  World world = roundWorld();
  DpsoConfig config;
  config.quantum_std = 0.0;
  config.confine = "none";
  Dpso swarm(world.map(), config, 3);
  swarm.reset(around(onCircle(0.0), 5.0));  // so that the start is not guided
  for (int image = 0; image < 20; ++image) {
    see(swarm, world.from(onCircle(0.0)));
    const std::vector<Particle>& particles = swarm.particles();
    const Eigen::Vector2d best_m =
        std::max_element(particles.begin(), particles.end(), [](const Particle& a, const Particle& b) {
          return a.weight < b.weight;
        })->position_m;
    see(swarm, world.inTheDark());
    EXPECT_EQ(swarm.particles().front().position_m, best_m) << "a quantum particle";
  }
}

/// Centre of the particles that are no quantum ones.
Eigen::Vector2d centreOfTravellers(const Dpso& swarm) {
  Eigen::Vector2d sum_m = Eigen::Vector2d::Zero();
  double count = 0.0;
  for (const Particle& particle : swarm.particles()) {
    if (particle.kind == ParticleKind::kQuantum) continue;
    sum_m += particle.position_m;
    count += 1.0;
  }
  return sum_m / count;
}

/// v0 after an image, by section 5 of the paper.
double adapted(double v0, double speed, const DpsoConfig& config) {
  const double ratio = speed / v0;
  const double next = ratio > 0.6 ? 1.1 * v0 : ratio < 0.4 ? 0.9 * v0 : v0;
  return std::min(std::max(next, config.v0_min), config.v0_max);
}

/// How often the limit of the speed rose, fell, stayed and was at an end of its range.
struct Adaptations {
  int faster = 0;
  int slower = 0;
  int same = 0;
  int clamped = 0;
};

/// Lets a swarm follow a robot and checks its speed and the limit after each image.
template <class Way>
Adaptations adaptationsOn(World& world, int images, const Way& way) {
  Eigen::Vector2d range_m = world.map().area().range();
  if (range_m.y() == 0.0) range_m.y() = 1.0;  // nothing moves across a straight street
  DpsoConfig config;
  config.recovery = "none";
  config.v0_max = 0.03;
  config.v0_min = 0.004;
  Dpso swarm(world.map(), config, 3);
  Adaptations seen;
  double ema = 0.0;
  double ema_mps = 0.0;
  Eigen::Vector2d before_m = Eigen::Vector2d::Zero();
  for (int image = 0; image < images; ++image) {
    const double v0 = swarm.tuning().v0;
    test::Seen input = world.from(way(image));
    if (image > 0) input.motion = Motion(0.25);
    see(swarm, input);
    const Eigen::Vector2d centre_m = centreOfTravellers(swarm);
    const double speed = (centre_m - before_m).cwiseQuotient(range_m).norm();
    const double speed_mps = (centre_m - before_m).norm() / 0.25;
    before_m = centre_m;
    if (image == 0) {
      EXPECT_EQ(swarm.tuning().v0, v0) << "one image has no speed";
      continue;
    }
    ema = image == 1 ? speed : 0.875 * ema + 0.125 * speed;
    EXPECT_NEAR(swarm.tuning().speed_ema, ema, 1e-12) << image;
    ema_mps = image == 1 ? speed_mps : 0.875 * ema_mps + 0.125 * speed_mps;
    EXPECT_NEAR(swarm.tuning().speed_mps, ema_mps, 1e-9) << image;
    EXPECT_NEAR(swarm.tuning().v0, adapted(v0, ema, config), 1e-12) << image;
    const double change = swarm.tuning().v0 / v0;
    seen.faster += change > 1.0999 ? 1 : 0;
    seen.slower += change < 0.9001 ? 1 : 0;
    seen.same += change == 1.0 ? 1 : 0;
    seen.clamped += swarm.tuning().v0 == config.v0_min || swarm.tuning().v0 == config.v0_max ? 1 : 0;
  }
  return seen;
}

TEST(SwarmEquations, TheSpeedOfTheSwarmIsAMovingAverageThatTheLimitFollowsByTenths) {
  World world = roundWorld();
  double arc_m = 0.0;
  const Adaptations seen = adaptationsOn(world, 400, [&arc_m](int image) {
    arc_m += image < 150 ? 0.2 : image < 250 ? 3.0 : 1.0;
    return onCircle(arc_m);
  });
  for (const int count : {seen.faster, seen.slower, seen.same, seen.clamped}) EXPECT_GT(count, 3);
}

TEST(SwarmEquations, OnAStraightStreetOnlyTheSpeedAlongItCounts) {
  World world(test::mapAt(test::street(200, 1.0)));
  const Adaptations seen =
      adaptationsOn(world, 150, [](int image) { return Eigen::Vector2d(image < 50 ? 20.0 : 2.0 * (image - 40), 0.0); });
  EXPECT_GT(seen.slower, 3);
  EXPECT_GT(seen.faster, 3);
}

TEST(SwarmEquations, RecoveryIsStepwiseAndEndsAtTheConfiguration) {
  World world = roundWorld();
  DpsoConfig config;
  config.recovery = "paper";
  config.recovery_step = 0.25;
  config.recovery_patience = 3;
  Dpso swarm(world.map(), config, 4);
  for (int image = 0; image < 60; ++image) see(swarm, world.from(onCircle(0.2 * image)));
  ASSERT_FALSE(swarm.tuning().recovering);
  const double v0 = swarm.tuning().v0;
  ASSERT_LT(v0, config.v0) << "a slow robot";
  for (int bad = 1; bad < 3; ++bad) {
    see(swarm, world.inTheDark());
    EXPECT_FALSE(swarm.tuning().recovering) << bad;
    EXPECT_EQ(swarm.tuning().quantum_share, 0.1) << bad;
  }
  const double still_m = swarm.tuning().v0;
  for (int step = 1; step <= 6; ++step) {
    see(swarm, world.inTheDark());
    const SwarmTuning tuning = swarm.tuning();
    ASSERT_TRUE(tuning.recovering);
    EXPECT_NEAR(tuning.v0, std::min(config.v0_max, still_m + step * 0.25 * (config.v0_max - config.v0)), 1e-12);
    EXPECT_NEAR(tuning.quantum_share, std::min(0.2, 0.1 + step * 0.025), 1e-12);
    EXPECT_NEAR(tuning.phi2, std::max(0.01, 0.6 - step * 0.25 * 0.59), 1e-12);
    EXPECT_EQ(tuning.phi0, config.phi0);
  }
  int image = 0;
  while (swarm.tuning().recovering && image < 60) {
    see(swarm, world.from(onCircle(12.0)));
    ++image;
  }
  EXPECT_EQ(swarm.tuning().v0, config.v0) << "not the limit of the slow robot before";
  EXPECT_EQ(swarm.tuning().quantum_share, config.quantum_share);
  EXPECT_EQ(swarm.tuning().phi2, config.phi2);
  const Eigen::Vector2d before_m = centreOfTravellers(swarm);
  see(swarm, world.from(onCircle(12.0)));
  const Eigen::Vector2d step_m = centreOfTravellers(swarm) - before_m;
  EXPECT_NEAR(swarm.tuning().speed_ema, step_m.cwiseQuotient(world.map().area().range()).norm(), 1e-12)
      << "the speed of the search is forgotten";
}

TEST(SwarmEquations, TheSpeedOverTheGroundStaysKnown) {
  World world = roundWorld();
  DpsoConfig config;
  config.recovery = "paper";
  Dpso swarm(world.map(), config, 4);
  const auto after = [&](test::Seen input, double seconds) {
    input.motion = Motion(seconds);
    see(swarm, input);
  };
  for (int image = 0; image < 10; ++image) after(world.from(onCircle(0.6 * image)), 1.0);
  const double known_mps = swarm.tuning().speed_mps;
  EXPECT_GT(known_mps, 0.0);
  const Eigen::Vector2d before_m = centreOfTravellers(swarm);
  after(world.from(onCircle(6.0)), 0.0);  // the stamp of the image before
  EXPECT_EQ(swarm.tuning().speed_mps, known_mps);
  after(world.from(onCircle(6.6)), 2.0);
  EXPECT_NEAR(swarm.tuning().speed_mps, 0.875 * known_mps + 0.125 * 0.5 * (centreOfTravellers(swarm) - before_m).norm(),
              1e-9);
  while (!swarm.tuning().recovering) after(world.inTheDark(), 1.0);
  for (int image = 0; image < 60 && swarm.tuning().recovering; ++image) after(world.from(onCircle(7.0)), 1.0);
  ASSERT_FALSE(swarm.tuning().recovering);
  EXPECT_GT(swarm.tuning().speed_mps, 0.0) << "the image that ends a recovery";
  const Eigen::Vector2d then_m = centreOfTravellers(swarm);
  after(world.from(onCircle(7.6)), 2.0);
  EXPECT_NEAR(swarm.tuning().speed_mps, 0.5 * (centreOfTravellers(swarm) - then_m).norm(), 1e-9)
      << "the speed of the search is forgotten";
  swarm.reset(anywhere(world.map().area()));
  EXPECT_EQ(swarm.tuning().speed_mps, 0.0);
  after(world.from(onCircle(7.6)), 1.0);
  after(world.from(onCircle(8.2)), 1.0);
  const Eigen::Vector2d restarted_m = centreOfTravellers(swarm);
  swarm.reset(anywhere(world.map().area()));
  after(world.from(onCircle(8.2)), 1.0);
  const Eigen::Vector2d first_m = centreOfTravellers(swarm);
  EXPECT_NE(first_m, restarted_m);
  after(world.from(onCircle(8.8)), 1.0);
  EXPECT_NEAR(swarm.tuning().speed_mps, (centreOfTravellers(swarm) - first_m).norm(), 1e-9)
      << "of its first step, not smoothed with what was before";
}

TEST(SwarmEquations, WhatIsAtItsLimitStaysThereInARecovery) {
  World world = roundWorld();
  DpsoConfig config;
  config.recovery = "paper";
  config.phi2_min = 0.6;  // phi2 has nowhere to go
  Dpso swarm(world.map(), config, 4);
  for (int image = 0; image < 5; ++image) see(swarm, world.inTheDark());
  EXPECT_EQ(swarm.tuning().phi2, 0.6);
  EXPECT_EQ(swarm.tuning().v0, config.v0_max);
}

TEST(SwarmEquations, TheLastParticlesHaveHighEnergyAndTheFirstAreQuantumParticles) {
  World world = roundWorld();
  DpsoConfig config;
  config.particles = 40;
  config.quantum_share = 0.25;
  config.high_energy_share = 0.2;
  const Dpso swarm(world.map(), config, 4);
  for (std::size_t i = 0; i < 40; ++i) {
    const ParticleKind expected = i < 10    ? ParticleKind::kQuantum
                                  : i >= 32 ? ParticleKind::kHighEnergy
                                            : ParticleKind::kStandard;
    EXPECT_EQ(swarm.particles()[i].kind, expected) << i;
  }
}

}  // namespace
}  // namespace visual_localization
