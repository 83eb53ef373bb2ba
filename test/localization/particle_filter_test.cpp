#include "localization/particle_filter.h"

#include <cmath>

#include <gtest/gtest.h>

#include "base/angles.h"
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
  return ParticleFilter(world.map(), makeMotionModel(tracker, config, world.map()), config, FitnessConfig(), seed);
}

class ParticleFilterTest : public ::testing::TestWithParam<const char*> {};

INSTANTIATE_TEST_SUITE_P(Motions, ParticleFilterTest, ::testing::Values("pf_gaussian", "pf_linear"));

TEST_P(ParticleFilterTest, FindsAndFollowsARobot) {
  World world = roundWorld();
  ParticleFilter filter = makeFilter(world, GetParam(), 1);
  double error_sum_m = 0.0;
  for (int step = 0; step < 150; ++step) {
    const Eigen::Vector2d robot = onCircle(0.6 * step);
    const TrackerEstimate estimate = filter.update(world.from(robot));
    if (step >= 60) error_sum_m += (estimate.position_m - robot).norm();
  }
  EXPECT_LT(error_sum_m / 90.0, 2.0);
}

TEST_P(ParticleFilterTest, FindsAKidnappedRobotAgain) {
  World world = roundWorld();
  ParticleFilter filter = makeFilter(world, GetParam(), 1);
  for (int step = 0; step < 60; ++step) filter.update(world.from(onCircle(0.6 * step)));
  double error_m = 0.0;
  for (int step = 60; step < 160; ++step) {
    const Eigen::Vector2d robot = onCircle(30.0 * kPi + 0.6 * step);
    error_m = (filter.update(world.from(robot)).position_m - robot).norm();
  }
  EXPECT_LT(error_m, 5.0);
}

TEST_P(ParticleFilterTest, AStraightStreetAndASingleImageWork) {
  for (const std::size_t images : {std::size_t{1}, std::size_t{50}}) {
    World world(test::mapAt(test::street(images, 2.0)));
    ParticleFilter filter = makeFilter(world, GetParam(), 1);
    TrackerEstimate estimate;
    for (int step = 0; step < 40; ++step) estimate = filter.update(world.from({0.0, 0.0}));
    EXPECT_LT(estimate.position_m.norm(), 5.0);
    EXPECT_TRUE(estimate.mode_covariance_m2.allFinite());
  }
}

TEST(ParticleFilter, TheEstimateIsTheWeightedMean) {
  World world = roundWorld();
  ParticleFilterConfig config;
  config.random_share = 0.0;  // nothing happens to the cloud after the estimate
  ParticleFilter filter = makeFilter(world, "pf_gaussian", 5, config);
  for (int step = 0; step < 10; ++step) {
    const TrackerEstimate estimate = filter.update(world.from(onCircle(0.6 * step)));
    EXPECT_LT((estimate.position_m - momentsOf(filter.particles()).mean_m).norm(), 1e-12);
    EXPECT_LT((estimate.spread_m - momentsOf(filter.particles()).spread()).norm(), 1e-12);
  }
}

TEST(ParticleFilter, TheWorstAreReplacedByRandomOnes) {
  World world = roundWorld();
  ParticleFilter filter = makeFilter(world, "pf_gaussian", 6);
  for (int step = 0; step < 60; ++step) filter.update(world.from(onCircle(0.0)));
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
  filter.update(world.from({0.0, 0.0}));
  EXPECT_DOUBLE_EQ(filter.particles()[0].position_m.x(), 10.0);
  filter.update(world.from({0.0, 0.0}));
  EXPECT_DOUBLE_EQ(filter.particles()[0].position_m.x(), 8.0);
}

}  // namespace
}  // namespace visual_localization
