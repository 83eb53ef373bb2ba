// Where the swarm differs from the papers, and the switches that make it as they say.

#include <algorithm>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "localization/papers/dpso.h"
#include "test/support/swarm_config.h"
#include "test/support/synthetic.h"
#include "test/support/world.h"
#include "visual_localization/localization/localizer_config.h"

namespace visual_localization {
namespace {

using test::onCircle;
using test::roundWorld;
using test::World;

constexpr int kDrivenImages = 60;

/// Runs a swarm around the circle, with a dark image now and then, and has `check` look at it after each image.
template <class Check>
void drive(const DpsoConfig& config, const Check& check) {
  World world = roundWorld();
  Dpso swarm(world.map(), config, 4);
  for (int image = 0; image < kDrivenImages; ++image) {
    const TrackerEstimate estimate = see(swarm, image % 10 == 9 ? world.inTheDark() : world.from(onCircle(image)));
    check(world.map(), swarm, estimate);
  }
}

bool isInside(const Area& area, const Eigen::Vector2d& position_m) {
  return (position_m.array() >= area.min_m.array()).all() && (position_m.array() <= area.max_m.array()).all();
}

int countOutside(const std::string& confine) {
  DpsoConfig config;
  config.confine = confine;
  int outside = 0;
  drive(config, [&](const TrainingMap& map, const Dpso& swarm, const TrackerEstimate&) {
    for (const Particle& particle : swarm.particles()) outside += isInside(map.area(), particle.position_m) ? 0 : 1;
  });
  return outside;
}

TEST(PaperDpso, ParticlesLeaveTheBoxUnlessItConfinesThem) {
  EXPECT_EQ(countOutside("box"), 0);
  EXPECT_GT(countOutside("none"), kDrivenImages);
  EXPECT_GT(countOutside("corridor"), kDrivenImages);
}

TEST(PaperDpso, ACorridorReachesSoFarFromATrainingImage) {
  DpsoConfig config;
  config.confine = "corridor";
  config.corridor_m = 3.0;
  int at_its_border = 0;
  drive(config, [&](const TrainingMap& map, const Dpso& swarm, const TrackerEstimate&) {
    for (const Particle& particle : swarm.particles()) {
      const double distance_m = map.nearest(particle.position_m).distance_m;
      ASSERT_LE(distance_m, 3.0 + 1e-9);
      at_its_border += distance_m > 3.0 - 1e-6 ? 1 : 0;
    }
  });
  EXPECT_GT(at_its_border, kDrivenImages);
}

/// The fastest of the standard particles, and of those of high energy, by the norm in shares of the range and of v0.
std::pair<double, double> fastest(const std::string& speed_limit) {
  DpsoConfig config;
  config.speed_limit = speed_limit;
  config.adapt_speed = false;
  config.recovery = "none";
  std::pair<double, double> fastest;
  drive(config, [&](const TrainingMap& map, const Dpso& swarm, const TrackerEstimate&) {
    for (const Particle& particle : swarm.particles()) {
      const double speed = particle.velocity_m.cwiseQuotient(map.area().range()).norm() / config.v0;
      double& of_kind = particle.kind == ParticleKind::kHighEnergy ? fastest.second : fastest.first;
      of_kind = std::max(of_kind, speed);
    }
  });
  return fastest;
}

TEST(PaperDpso, TheSpeedLimitIsOfTheNormOrOfEachAxis) {
  EXPECT_NEAR(fastest("norm").first, 1.0, 1e-9);
  EXPECT_NEAR(fastest("norm").second, 3.0, 1e-9);
  EXPECT_NEAR(fastest("axis").first, std::sqrt(2.0), 1e-3);
  EXPECT_NEAR(fastest("axis").second, 3.0 * std::sqrt(2.0), 1e-2);
}

TEST(PaperDpso, TheEstimateIsTheBestParticleTheBestFewOrTheWeightedCentre) {
  for (const char* position : {"best", "k_best", "centre"}) {
    DpsoConfig config;
    config.position = position;
    config.best_particles = 3;
    int apart = 0;
    drive(config, [&](const TrainingMap&, const Dpso& swarm, const TrackerEstimate& estimate) {
      if (!estimate.best.recognised) return;
      std::vector<Particle> order = swarm.particles();
      std::stable_sort(order.begin(), order.end(),
                       [](const Particle& a, const Particle& b) { return a.weight > b.weight; });
      Eigen::Vector2d centre_m = Eigen::Vector2d::Zero();
      for (const Particle& particle : order) centre_m += particle.weight * particle.position_m;
      const Eigen::Vector2d few_m = (order[0].position_m + order[1].position_m + order[2].position_m) / 3.0;
      const std::string name = position;
      const Eigen::Vector2d expected_m = name == "best" ? order[0].position_m : name == "k_best" ? few_m : centre_m;
      ASSERT_LT((estimate.position_m - expected_m).norm(), 1e-9) << position;
      apart += (few_m - centre_m).norm() > 1e-3 && (few_m - order[0].position_m).norm() > 1e-3 ? 1 : 0;
    });
    EXPECT_GT(apart, kDrivenImages / 2) << position;
  }
}

/// v_sw of the second image, in shares of the range, and that of the particles that count.
void expectSpeed(const std::string& speed_of, bool quantum_counts) {
  World world = roundWorld();
  DpsoConfig config;
  config.speed_of = speed_of;
  config.quantum_share = 0.2;
  Dpso swarm(world.map(), config, 4);
  const auto centre_m = [&] {
    Eigen::Vector2d sum_m = Eigen::Vector2d::Zero();
    double count = 0.0;
    for (const Particle& particle : swarm.particles()) {
      if (particle.kind == ParticleKind::kQuantum && !quantum_counts) continue;
      sum_m += particle.position_m;
      count += 1.0;
    }
    return Eigen::Vector2d(sum_m / count);
  };
  see(swarm, world.from(onCircle(0.0)));
  const Eigen::Vector2d before_m = centre_m();
  see(swarm, world.from(onCircle(1.0)));
  const double speed = (centre_m() - before_m).cwiseQuotient(world.map().area().range()).norm();
  EXPECT_NEAR(swarm.tuning().speed_ema, speed, 1e-12) << speed_of;
}

TEST(PaperDpso, TheSpeedOfTheSwarmIsThatOfAllOrOfThoseThatTravel) {
  expectSpeed("all", true);
  expectSpeed("moving", false);
}

TEST(PaperDpso, RecoveryRaisesThePerturbationStepByStepAndEndsAtOnce) {
  World world = roundWorld();
  DpsoConfig config;
  config.recovery = "paper";
  config.recovery_patience = 2;
  config.recovery_step = 0.5;
  config.phi0_max = 0.9;
  Dpso swarm(world.map(), config, 4);
  for (int image = 0; image < 30; ++image) see(swarm, world.from(onCircle(0.5 * image)));
  EXPECT_DOUBLE_EQ(swarm.tuning().phi0, 0.3);
  for (const double expected : {0.3, 0.6, 0.9, 0.9}) {
    see(swarm, world.inTheDark());
    EXPECT_NEAR(swarm.tuning().phi0, expected, 1e-12);
  }
  for (int image = 30; image < 80 && swarm.tuning().recovering; ++image) see(swarm, world.from(onCircle(0.5 * image)));
  EXPECT_FALSE(swarm.tuning().recovering);
  EXPECT_DOUBLE_EQ(swarm.tuning().phi0, 0.3);
}

TEST(PaperDpso, RecoveryLeavesAnyPerturbationAloneUnlessToldToRaiseIt) {
  for (const double phi0 : {0.005, 0.3, 1.5}) {
    LocalizerConfig config = test::swarmConfig();
    assignParameters(config, {{"dpso/phi0", phi0}, {"recovery", std::string("paper")}});
    World world = roundWorld();
    Dpso swarm(world.map(), config.dpso, 4);
    for (int image = 0; image < 10; ++image) see(swarm, world.inTheDark());
    EXPECT_TRUE(swarm.tuning().recovering);
    EXPECT_DOUBLE_EQ(swarm.tuning().phi0, phi0);
  }
}

TEST(PaperDpso, AtTheBorderTheVelocityIsTurned) {
  DpsoConfig config;
  config.confine = "reflect";
  config.v0 = config.v0_max;
  config.phi2 = 0.02;  // hardly drawn to the best one, they fly to the border
  config.adapt_speed = false;
  config.recovery = "none";
  int turned = 0;
  drive(config, [&](const TrainingMap& map, const Dpso& swarm, const TrackerEstimate&) {
    const Area area = map.area();
    for (const Particle& particle : swarm.particles()) {
      ASSERT_TRUE(isInside(area, particle.position_m));
      for (int axis = 0; axis < 2; ++axis) {
        const double position_m = particle.position_m[axis];
        const bool at_min = position_m == area.min_m[axis];
        const bool at_max = position_m == area.max_m[axis];
        EXPECT_FALSE(at_min && particle.velocity_m[axis] < 0.0);
        EXPECT_FALSE(at_max && particle.velocity_m[axis] > 0.0);
        turned += (at_min || at_max) && particle.velocity_m[axis] != 0.0 ? 1 : 0;
      }
    }
  });
  EXPECT_GT(turned, 0);
}

TEST(PaperDpso, ByTheDiagonalTheLimitIsACircle) {
  DpsoConfig config;
  config.speed_limit = "diagonal";
  config.adapt_speed = false;
  config.recovery = "none";
  double most = 0.0;
  drive(config, [&](const TrainingMap& map, const Dpso& swarm, const TrackerEstimate&) {
    const double limit_m = config.v0 * map.area().range().norm();
    for (const Particle& particle : swarm.particles()) {
      if (particle.kind == ParticleKind::kStandard) most = std::max(most, particle.velocity_m.norm() / limit_m);
    }
  });
  EXPECT_LE(most, 1.0 + 1e-9);
  EXPECT_GT(most, 0.95);
}

TEST(PaperDpso, ASlowSwarmLowersItsLimitByTheDecrease) {
  DpsoConfig config;
  config.v0_decrease = 0.97;
  config.recovery = "none";
  World world = roundWorld();
  Dpso swarm(world.map(), config, 4);
  std::vector<double> limits;
  for (int image = 0; image < 60; ++image) {
    see(swarm, world.from(onCircle(0.0)));
    limits.push_back(swarm.tuning().v0);
  }
  int falls = 0;
  for (std::size_t i = 1; i < limits.size(); ++i) {
    if (limits[i] >= limits[i - 1]) continue;
    EXPECT_NEAR(limits[i] / limits[i - 1], 0.97, 1e-9);
    ++falls;
  }
  EXPECT_GT(falls, 5);
}

TEST(PaperDpso, ByTheMeanVelocityOppositeParticlesStandStill) {
  const auto speedBy = [](const std::string& speed_of) {
    DpsoConfig config;
    config.speed_of = speed_of;
    config.ema_start = "growing";
    config.recovery = "none";
    config.adapt_speed = false;
    double sum = 0.0;
    drive(config,
          [&](const TrainingMap&, const Dpso& swarm, const TrackerEstimate&) { sum += swarm.tuning().speed_ema; });
    return sum;
  };
  EXPECT_GT(speedBy("velocity"), 0.0);
  EXPECT_LT(speedBy("velocity"), speedBy("all")) << "quantum particles jump and turns cancel";
}

TEST(PaperDpso, TheyMayPerturbParticlesOfHighEnergyMore) {
  const auto spreadOfHighEnergy = [](bool more) {
    DpsoConfig config;
    config.high_energy_perturbation = more;
    config.high_energy_factor = 10.0;
    config.adapt_speed = false;
    config.recovery = "none";
    double sum = 0.0;
    drive(config, [&](const TrainingMap&, const Dpso& swarm, const TrackerEstimate&) {
      for (const Particle& particle : swarm.particles()) {
        if (particle.kind == ParticleKind::kHighEnergy) sum += particle.velocity_m.norm();
      }
    });
    return sum;
  };
  EXPECT_GT(spreadOfHighEnergy(true), 1.2 * spreadOfHighEnergy(false));
}

}  // namespace
}  // namespace visual_localization
