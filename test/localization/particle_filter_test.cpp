#include "localization/papers/particle_filter.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "base/numbers.h"
#include "test/support/synthetic.h"
#include "test/support/world.h"
#include "visual_localization/localization/particles.h"

namespace visual_localization {
namespace {

using test::onCircle;
using test::roundWorld;
using test::World;

ParticleFilter makeFilter(const World& world, const std::string& tracker, std::uint32_t seed,
                          const ParticleFilterConfig& config = {}) {
  return ParticleFilter(world.map(), makeMotionModel(tracker, config, world.map()), config, seed);
}

class ParticleFilterTest : public ::testing::TestWithParam<const char*> {};

INSTANTIATE_TEST_SUITE_P(Motions, ParticleFilterTest, ::testing::Values("pf_gaussian", "pf_linear"));

TEST_P(ParticleFilterTest, FindsAndFollowsARobot) {
  World world = roundWorld();
  ParticleFilter filter = makeFilter(world, GetParam(), 1);
  double error_sum_m = 0.0;
  for (int step = 0; step < 150; ++step) {
    const Eigen::Vector2d robot = onCircle(0.6 * step);
    const TrackerEstimate estimate = see(filter, world.from(robot));
    if (step >= 60) error_sum_m += (estimate.position_m - robot).norm();
  }
  EXPECT_LT(error_sum_m / 90.0, 2.0);
}

TEST_P(ParticleFilterTest, FindsAKidnappedRobotAgain) {
  World world = roundWorld();
  ParticleFilter filter = makeFilter(world, GetParam(), 1);
  for (int step = 0; step < 60; ++step) see(filter, world.from(onCircle(0.6 * step)));
  double error_m = 0.0;
  for (int step = 60; step < 160; ++step) {
    const Eigen::Vector2d robot = onCircle(30.0 * kPi + 0.6 * step);
    error_m = (see(filter, world.from(robot)).position_m - robot).norm();
  }
  EXPECT_LT(error_m, 5.0);
}

TEST_P(ParticleFilterTest, AStraightStreetAndASingleImageWork) {
  for (const std::size_t images : {std::size_t{1}, std::size_t{50}}) {
    World world(test::mapAt(test::street(images, 2.0)));
    ParticleFilter filter = makeFilter(world, GetParam(), 1);
    TrackerEstimate estimate;
    for (int step = 0; step < 40; ++step) estimate = see(filter, world.from({0.0, 0.0}));
    EXPECT_LT(estimate.position_m.norm(), 4.0) << "a step of the motion";
    EXPECT_TRUE(estimate.mode_covariance_m2.allFinite());
  }
}

TEST(ParticleFilter, TheEstimateIsTheWeightedMean) {
  World world = roundWorld();
  ParticleFilterConfig config;
  config.random_share = 0.0;  // nothing happens to the cloud after the estimate
  ParticleFilter filter = makeFilter(world, "pf_gaussian", 5, config);
  for (int step = 0; step < 10; ++step) {
    const TrackerEstimate estimate = see(filter, world.from(onCircle(0.6 * step)));
    EXPECT_LT((estimate.position_m - momentsOf(filter.particles()).mean_m).norm(), 1e-12);
    EXPECT_LT((estimate.spread_m - momentsOf(filter.particles()).spread()).norm(), 1e-12);
  }
}

TEST(ParticleFilter, TheWorstAreReplacedByRandomOnes) {
  World world = roundWorld();
  ParticleFilter filter = makeFilter(world, "pf_gaussian", 6);
  for (int step = 0; step < 60; ++step) see(filter, world.from(onCircle(0.0)));
  std::size_t far = 0;
  for (const Particle& particle : filter.particles())
    far += (particle.position_m - onCircle(0.0)).norm() > 20.0 ? 1 : 0;
  EXPECT_GE(far, 5u);  // of 15 drawn anywhere
  EXPECT_LE(far, 30u);
}

TEST(ParticleFilter, AParticleIsPulledToItsTrainingImage) {
  World world(test::mapAt({{0.0, 0.0}}));
  ParticleFilterConfig config;
  config.gaussian_std_m = 0.0;
  config.random_share = 0.0;
  ParticleFilter filter = makeFilter(world, "pf_gaussian", 1, config);
  filter.reset(around({10.0, 0.0}, 0.0));
  see(filter, world.from({0.0, 0.0}));
  EXPECT_DOUBLE_EQ(filter.particles()[0].position_m.x(), 10.0);
  see(filter, world.from({0.0, 0.0}));
  EXPECT_DOUBLE_EQ(filter.particles()[0].position_m.x(), 8.0);
}

TEST(ParticleFilter, WhatIsInjectedHasAMeanWeightAndTheFirstSpeedInAnyDirection) {
  World world = roundWorld();
  ParticleFilterConfig config;
  config.particles = 200;
  config.random_share = 0.25;
  config.acceleration_std = 0.1;  // so that the others have another speed
  config.pull = 0.0;
  ParticleFilter filter = makeFilter(world, "pf_linear", 7, config);
  for (int image = 0; image < 10; ++image) see(filter, world.from(onCircle(0.0)));
  std::vector<Particle> injected;
  double least_of_others = 1.0;
  for (const Particle& particle : filter.particles()) {
    if (std::abs(particle.velocity_m.norm() - config.initial_speed_m) < 1e-12) {
      injected.push_back(particle);
    } else {
      least_of_others = std::min(least_of_others, particle.weight);
    }
  }
  ASSERT_EQ(injected.size(), 50U) << "a quarter";
  Eigen::Vector2d mean_direction = Eigen::Vector2d::Zero();
  for (const Particle& particle : injected) {
    EXPECT_EQ(particle.weight, injected.front().weight);
    mean_direction += particle.velocity_m.normalized() / 50.0;
  }
  EXPECT_LT(mean_direction.norm(), 0.35) << "any direction";
  // Each weighs 1/200 beside the others, whose weights summed to one with those that were taken away: a share of one
  // that is not known here. If that share is w, an injected one weighs 0.005 / (w + 0.25) now.
  const double lightest = 0.005 / 1.25;  // w = 1: the worst weighed nothing
  const double heaviest = 0.005 / 1.0;   // w = 0.75: they weighed as much as all others
  EXPECT_GE(injected.front().weight, lightest - 1e-12);
  EXPECT_LE(injected.front().weight, heaviest + 1e-12);
  EXPECT_LT(least_of_others, injected.front().weight) << "the worst were replaced, not the best";
}

TEST(ParticleFilter, OneOfFiftyIsInjectedWhereTheShareSaysSo) {
  World world = roundWorld();
  ParticleFilterConfig config;
  config.particles = 50;
  config.random_share = 0.02;
  ParticleFilter filter = makeFilter(world, "pf_gaussian", 7, config);
  filter.reset(around(onCircle(0.0), 2.0));
  int far_away = 0;
  for (int image = 0; image < 20; ++image) {
    see(filter, world.from(onCircle(0.0)));
    far_away += std::any_of(filter.particles().begin(), filter.particles().end(), [](const Particle& particle) {
      return (particle.position_m - onCircle(0.0)).norm() > 15.0;
    });
  }
  EXPECT_GE(far_away, 15);
}

TEST(ParticleFilter, BeforeTheFirstImageAllWeighAlikeAndNothingMoves) {
  World world = roundWorld();
  ParticleFilterConfig config;
  config.random_share = 0.0;
  ParticleFilter filter = makeFilter(world, "pf_gaussian", 7, config);
  for (int start = 0; start < 2; ++start) {
    const std::vector<Particle> before = filter.particles();
    for (const Particle& particle : before) EXPECT_DOUBLE_EQ(particle.weight, 1.0 / 300.0);
    see(filter, world.from(onCircle(0.0)));
    for (std::size_t i = 0; i < before.size(); ++i) EXPECT_EQ(filter.particles()[i].position_m, before[i].position_m);
    filter.reset(anywhere(world.map().area()));
  }
}

TEST(ParticleFilter, TheEstimateNamesItsTrainingImages) {
  World world = roundWorld();
  ParticleFilter filter = makeFilter(world, "pf_linear", 7);
  for (int image = 0; image < 30; ++image) {
    const bool dark = image % 10 == 9;
    const test::Seen input = dark ? world.inTheDark() : world.from(onCircle(0.6 * image));
    const TrackerEstimate estimate = see(filter, input);
    EXPECT_EQ(estimate.training_image, world.map().nearest(estimate.position_m).image);
    const std::size_t best =
        estimate.best.similarity > 0.0 ? input.scores.mostSimilar().front() : estimate.training_image;
    EXPECT_EQ(estimate.best_image, best);
    EXPECT_NEAR(estimate.best_distance_m, (world.map().position_m(best) - estimate.position_m).norm(), 1e-12);
  }
}

/// Standing particles, without new ones.
ParticleFilterConfig standingConfig(int particles) {
  ParticleFilterConfig config;
  config.particles = particles;
  config.gaussian_std_m = 0.0;
  config.pull = 0.0;
  config.random_share = 0.0;
  return config;
}

TEST(ParticleFilter, WhoHasAllTheWeightIsDrawnAlways) {
  World world = roundWorld();
  for (const int heavy : {0, 1, 7, 19}) {
    ParticleFilter filter = makeFilter(world, "pf_gaussian", 7, standingConfig(20));
    int drawn = 0;
    filter.reset(Prior([&drawn, heavy](Random&) { return onCircle(drawn++ == heavy ? 20.0 : 100.0); }));
    see(filter, world.from(onCircle(20.0)));
    ASSERT_GT(filter.particles()[static_cast<std::size_t>(heavy)].weight, 1.0 - 1e-9);
    see(filter, world.from(onCircle(20.0)));
    for (const Particle& particle : filter.particles()) EXPECT_EQ(particle.position_m, onCircle(20.0)) << heavy;
  }
}

TEST(ParticleFilter, EachIsDrawnAsOftenAsItsWeightSays) {
  World world = roundWorld();
  for (std::uint32_t seed = 1; seed <= 20; ++seed) {
    ParticleFilter filter = makeFilter(world, "pf_gaussian", seed, standingConfig(50));
    filter.reset(around(onCircle(20.0), 5.0));
    see(filter, world.from(onCircle(20.0)));
    const std::vector<Particle> before = filter.particles();
    see(filter, world.from(onCircle(20.0)));
    for (const Particle& one : before) {
      const auto drawn = std::count_if(filter.particles().begin(), filter.particles().end(),
                                       [&](const Particle& other) { return other.position_m == one.position_m; });
      EXPECT_LT(std::abs(static_cast<double>(drawn) - 50.0 * one.weight), 1.0 + 1e-9) << seed;
    }
  }
}

TEST(ParticleFilter, AVerifiedPositionWeighsTheParticles) {
  World world = roundWorld();
  ParticleFilterConfig config;
  config.random_share = 0.0;
  ParticleFilter filter = makeFilter(world, "pf_gaussian", 7, config);
  test::Seen input = world.from(onCircle(100.0));
  input.verified_m = onCircle(10.0);
  see(filter, input);
  EXPECT_EQ(input.scores.comparisons(), 0U);
  double sum = 0.0;
  PoseLikelihood first(world.map(), onCircle(10.0));
  for (const Particle& particle : filter.particles()) sum += first.at(particle.position_m).value;
  for (const Particle& particle : filter.particles()) {
    EXPECT_NEAR(particle.weight, first.at(particle.position_m).value / sum, 1e-12);
  }
  const std::vector<Particle> before = filter.particles();
  PoseLikelihood second(world.map(), onCircle(12.0));
  filter.update(second);
  double total = 0.0;
  for (const Particle& particle : before) total += particle.weight * second.at(particle.position_m).value;
  for (std::size_t i = 0; i < before.size(); ++i) {
    const double expected = before[i].weight * second.at(before[i].position_m).value / total;
    EXPECT_NEAR(filter.particles()[i].weight, expected, 1e-12) << "one more likelihood";
  }
}

TEST(ParticleFilter, AReconfigurationReachesTheMotion) {
  World world = roundWorld();
  TrackerConfig config;
  config.tracker = "pf_gaussian";
  config.pf.random_share = 0.0;
  config.pf.pull = 0.0;
  ParticleFilter filter = makeFilter(world, config.tracker, 7, config.pf);
  see(filter, world.from(onCircle(0.0)));
  config.pf.gaussian_std_m = 0.0;
  filter.configure(config);
  const std::vector<Particle> before = filter.particles();
  test::Seen input = world.from(onCircle(0.0));
  see(filter, input);
  double sum = 0.0;
  std::vector<double> fitness;
  for (const Particle& particle : filter.particles()) {
    const bool stood = std::any_of(before.begin(), before.end(),
                                   [&](const Particle& other) { return other.position_m == particle.position_m; });
    EXPECT_TRUE(stood) << "without noise a particle stays";
    fitness.push_back(input.likelihood.at(particle.position_m).value);
    sum += fitness.back();
  }
  for (std::size_t i = 0; i < fitness.size(); ++i) EXPECT_NEAR(filter.particles()[i].weight, fitness[i] / sum, 1e-12);
}

/// A filter as the toolkit of the authors runs it.
ParticleFilterConfig programConfig(int particles) {
  ParticleFilterConfig config;
  config.particles = particles;
  config.selection = "scaled";
  config.draws = "independent";
  config.random_particles = "selection";
  config.confine = "box";
  config.position = "best";
  config.pull = 0.0;
  return config;
}

TEST(ParticleFilter, AsInTheProgramItFindsAndFollowsARobotInTheArea) {
  World world = roundWorld();
  ParticleFilter filter = makeFilter(world, "pf_linear", 3, programConfig(300));
  const Area area = world.map().area();
  double error_sum_m = 0.0;
  for (int step = 0; step < 150; ++step) {
    const Eigen::Vector2d robot = onCircle(0.6 * step);
    const TrackerEstimate estimate = see(filter, world.from(robot));
    const auto best = std::max_element(filter.particles().begin(), filter.particles().end(),
                                       [](const Particle& a, const Particle& b) { return a.weight < b.weight; });
    EXPECT_EQ(estimate.position_m, best->position_m);
    for (const Particle& particle : filter.particles()) {
      EXPECT_TRUE((particle.position_m.array() >= area.min_m.array()).all());
      EXPECT_TRUE((particle.position_m.array() <= area.max_m.array()).all());
    }
    if (step >= 60) error_sum_m += (estimate.position_m - robot).norm();
  }
  EXPECT_LT(error_sum_m / 90.0, 3.0);
}

/// How often one selection draws a particle with at least 0.9 of the largest weight and one with next to none.
std::pair<double, double> drawnOfBestAndWorst(const std::string& selection, const std::string& draws) {
  World world = roundWorld();
  ParticleFilterConfig config;
  config.particles = 50000;
  config.selection = selection;
  config.draws = draws;
  config.random_share = 0.0;
  config.pull = 0.0;
  config.gaussian_std_m = 0.0;  // a survivor stays where its ancestor was
  ParticleFilter filter = makeFilter(world, "pf_gaussian", 3, config);
  see(filter, world.from(onCircle(0.0)));
  const std::vector<Particle> before = filter.particles();
  see(filter, world.from(onCircle(0.0)));
  std::map<std::pair<double, double>, double> offspring;
  for (const Particle& particle : filter.particles()) ++offspring[{particle.position_m.x(), particle.position_m.y()}];
  double most = 0.0;
  for (const Particle& particle : before) most = std::max(most, particle.weight);
  const auto meanWhere = [&](double from, double to) {
    double sum = 0.0;
    double count = 0.0;
    for (const Particle& particle : before) {
      if (particle.weight < from * most || particle.weight > to * most) continue;
      sum += offspring[{particle.position_m.x(), particle.position_m.y()}];
      count += 1.0;
    }
    return sum / count;
  };
  return {meanWhere(0.9, 1.0), meanWhere(0.0, 1e-3)};
}

TEST(ParticleFilter, ScaledTheBestAreDrawnThreeTimesAsOftenAsTheWorst) {
  for (const char* draws : {"low_variance", "independent"}) {
    const auto [best, worst] = drawnOfBestAndWorst("scaled", draws);
    EXPECT_NEAR(best / worst, (0.95 + 0.5) / 0.5, 0.3) << draws;
    const auto [best_by_weight, worst_by_weight] = drawnOfBestAndWorst("weights", draws);
    EXPECT_GT(best_by_weight, 300.0 * worst_by_weight) << draws;
  }
}

TEST(ParticleFilter, VInitByTheRangeIsFasterAlongTheLongerAxis) {
  const auto map = test::mapAt({{0.0, 0.0}, {300.0, 0.0}, {300.0, 100.0}, {0.0, 100.0}});
  ParticleFilterConfig config;
  config.initial_speed_of = "range";
  const auto motion = makeMotionModel("pf_linear", config, *map);
  Random random(1);
  Eigen::Vector2d fastest = Eigen::Vector2d::Zero();
  double squares = 0.0;
  for (int i = 0; i < 4000; ++i) {
    Particle particle;
    motion->start(particle, random);
    fastest = fastest.cwiseMax(particle.velocity_m.cwiseAbs());
    squares += particle.velocity_m.squaredNorm() / 4000.0;
  }
  EXPECT_NEAR(fastest.x() / fastest.y(), 3.0, 0.01);
  EXPECT_NEAR(std::sqrt(squares), config.initial_speed_m, 0.05) << "on average as fast as in metres";
}

}  // namespace
}  // namespace visual_localization
