#include <cmath>
#include <memory>
#include <utility>
#include <vector>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include "base/numbers.h"
#include "localization/papers/particle_filter.h"
#include "test/support/synthetic.h"
#include "test/support/world.h"
#include "visual_localization/localization/particles.h"

namespace visual_localization {
namespace {

/// What a user with wheel odometry would write: the direction of a particle's velocity is the robot's heading.
class OdometryMotion final : public MotionModel {
 public:
  void start(Particle& particle, Random& random) const override {
    particle.velocity_m = Eigen::Rotation2Dd(random.uniform(-kPi, kPi)) * Eigen::Vector2d::UnitX();
  }
  void move(Particle& particle, const Motion& travel, Random&) const override {
    const Eigen::Vector2d heading = particle.velocity_m;
    const Eigen::Vector2d left(-heading.y(), heading.x());
    particle.position_m += travel.increment().translation_m.x() * heading + travel.increment().translation_m.y() * left;
    particle.velocity_m = Eigen::Rotation2Dd(travel.increment().rotation_rad) * heading;
  }
};

template <class... Models>
std::unique_ptr<MotionModel> combined(Models... models) {
  std::vector<std::unique_ptr<MotionModel>> parts;
  (parts.push_back(std::make_unique<Models>(std::move(models))), ...);
  return std::make_unique<CombinedMotion>(std::move(parts));
}

Particle standingAt(double x, double y) {
  Particle particle;
  particle.position_m = {x, y};
  return particle;
}

TEST(MotionModel, LinearKeepsAndDisturbsTheVelocity) {
  Random random(1);
  Particle particle;
  const LinearMotion straight(0.0, 0.0, {2.0, 2.0});
  straight.start(particle, random);
  EXPECT_NEAR(particle.velocity_m.norm(), 2.0, 1e-12);
  const Eigen::Vector2d velocity = particle.velocity_m;
  straight.move(particle, Motion(), random);
  straight.move(particle, Motion(), random);
  EXPECT_LT((particle.position_m - 2.0 * velocity).norm(), 1e-12);

  const LinearMotion disturbed(kPi / 3.0, 0.1, {2.0, 2.0});
  double turned_squared = 0.0;
  double scaled_squared = 0.0;
  for (int i = 0; i < 4000; ++i) {
    particle.velocity_m = {1.0, 0.0};
    disturbed.move(particle, Motion(), random);
    const double log_speed = std::log(particle.velocity_m.norm());
    scaled_squared += log_speed * log_speed / 4000.0;
    turned_squared += std::cos(std::atan2(particle.velocity_m.y(), particle.velocity_m.x())) / 4000.0;
  }
  EXPECT_NEAR(std::sqrt(scaled_squared), 0.1, 0.005);
  EXPECT_NEAR(turned_squared, std::exp(-0.5 * kPi * kPi / 9.0), 0.03);  // mean cosine of a normal angle
}

TEST(MotionModel, GaussianStepsHaveTheGivenSpread) {
  Random random(2);
  const GaussianMotion motion(4.0);
  double squared = 0.0;
  for (int i = 0; i < 4000; ++i) {
    Particle particle;
    motion.move(particle, Motion(), random);
    squared += particle.position_m.squaredNorm() / 8000.0;
  }
  EXPECT_NEAR(std::sqrt(squared), 4.0, 0.15);
}

TEST(MotionModel, PullsAShareOfTheWayToTheNearestTrainingImage) {
  const auto map = test::mapAt({{0.0, 0.0}, {10.0, 0.0}});
  Random random(3);
  for (const double share : {0.0, 0.2, 1.0}) {
    Particle particle = standingAt(7.0, 5.0);
    particle.velocity_m = {1.0, 2.0};
    PullToMap(*map, share).move(particle, Motion(), random);
    EXPECT_DOUBLE_EQ(particle.position_m.x(), 7.0 + share * 3.0);
    EXPECT_DOUBLE_EQ(particle.position_m.y(), 5.0 - share * 5.0);
    EXPECT_EQ(particle.velocity_m, Eigen::Vector2d(1.0, 2.0));
  }
}

TEST(MotionModel, PartsMoveOneAfterTheOther) {
  const auto map = test::mapAt({{0.0, 0.0}, {100.0, 0.0}});
  Random random(4);
  const Motion travel(0.0, OdometryIncrement{{60.0, 0.0}, 0.0});
  Particle particle = standingAt(10.0, 0.0);
  particle.velocity_m = {1.0, 0.0};
  Particle other = particle;
  combined(OdometryMotion(), PullToMap(*map, 0.5))->move(particle, travel, random);
  EXPECT_DOUBLE_EQ(particle.position_m.x(), 85.0);  // to 70, then half of the way to 100
  combined(PullToMap(*map, 0.5), OdometryMotion())->move(other, travel, random);
  EXPECT_DOUBLE_EQ(other.position_m.x(), 65.0);  // half of the way to 0, then 60 on
}

TEST(MotionModel, EveryPartStartsAParticle) {
  Random random(5);
  Particle particle;
  combined(GaussianMotion(1.0), LinearMotion(0.0, 0.0, {1.8, 1.8}))->start(particle, random);
  EXPECT_NEAR(particle.velocity_m.norm(), 1.8, 1e-12);
  EXPECT_EQ(particle.position_m, Eigen::Vector2d(0.0, 0.0));
}

TEST(MotionModel, WithoutPartsNothingMoves) {
  Random random(6);
  Particle particle = standingAt(1.0, 2.0);
  combined()->move(particle, Motion(), random);
  EXPECT_EQ(particle.position_m, Eigen::Vector2d(1.0, 2.0));
}

TEST(MotionModel, OdometryAndGaussianNoiseAdd) {
  const auto motion = combined(OdometryMotion(), GaussianMotion(0.5));
  const Motion travel(0.0, OdometryIncrement{{3.0, 1.0}, kPi / 2.0});
  Random random(7);
  std::vector<Particle> cloud(4000);
  for (Particle& particle : cloud) {
    particle.weight = 1.0 / static_cast<double>(cloud.size());
    particle.velocity_m = {0.0, 1.0};  // looks north
    motion->move(particle, travel, random);
    motion->move(particle, travel, random);  // looks west by then
  }
  const CloudMoments moments = momentsOf(cloud);
  // 3 m north and 1 m west, then 3 m west and 1 m south.
  EXPECT_LT((moments.mean_m - Eigen::Vector2d(-4.0, 2.0)).norm(), 0.04);
  EXPECT_NEAR(moments.spread().x(), 0.5 * std::sqrt(2.0), 0.03);
  EXPECT_NEAR(moments.spread().y(), 0.5 * std::sqrt(2.0), 0.03);
}

/// A particle filter follows a robot through the dark by odometry alone, and stays where it is without.
TEST(MotionModel, OdometryReachesTheParticlesOfAFilter) {
  test::World world(test::mapAt(test::street(100, 1.0)));
  ParticleFilterConfig config;
  config.random_share = 0.0;
  for (const bool with_odometry : {true, false}) {
    ParticleFilter filter(world.map(), combined(OdometryMotion(), GaussianMotion(0.1)), config, 1);
    filter.reset(around({50.0, 0.0}, 0.5));
    see(filter, world.inTheDark());
    for (int step = 0; step < 10; ++step) {
      test::Seen input = world.inTheDark();
      if (with_odometry) input.motion = Motion(0.0, OdometryIncrement{{2.0, 0.0}, 0.0});
      see(filter, input);
    }
    double distance_sum_m = 0.0;
    for (const Particle& particle : filter.particles()) {
      distance_sum_m += particle.weight * (particle.position_m - Eigen::Vector2d(50.0, 0.0)).norm();
    }
    EXPECT_NEAR(distance_sum_m, with_odometry ? 20.0 : 0.0, 1.0);
  }
}

TEST(MotionModel, OfAFilterFollowsOdometryWithAShareOfItsParticles) {
  const auto map = test::mapAt({{0.0, 0.0}, {0.0, 10.0}, {0.0, 20.0}});  // drives north
  ParticleFilterConfig config;
  config.pull = 0.0;
  config.gaussian_std_m = 0.0;
  OdometryConfig odometry;
  odometry.share = 0.5;
  odometry.distance_sigma = 0.1;
  const auto motion = makeMotionModel("pf_gaussian", config, *map);
  const Motion travel(0.0, OdometryIncrement{{8.0, 1.0}, 0.0, 10.0}, odometry);
  Random random(9);
  std::vector<Particle> moved;
  constexpr int kParticles = 4000;
  for (int i = 0; i < kParticles; ++i) {
    Particle particle = standingAt(0.0, 5.0);
    motion->move(particle, travel, random);
    if (particle.position_m != Eigen::Vector2d(0.0, 5.0)) moved.push_back(particle);
  }
  EXPECT_NEAR(static_cast<double>(moved.size()) / kParticles, 0.5, 0.03);
  for (Particle& particle : moved) particle.weight = 1.0;
  const CloudMoments moments = momentsOf(moved);
  EXPECT_LT((moments.mean_m - Eigen::Vector2d(-1.0, 13.0)).norm(), 0.1) << "8 m ahead and 1 m to the left";
  EXPECT_NEAR(moments.spread().x(), 0.2 + 0.1 * 10.0, 0.05);
  EXPECT_NEAR(moments.spread().y(), 0.2 + 0.1 * 10.0, 0.05);
}

TEST(MotionModel, ParticlesStartInAllDirections) {
  const LinearMotion motion(0.0, 0.0, {2.0, 2.0});
  Random random(10);
  int quadrants[4] = {};
  for (int i = 0; i < 4000; ++i) {
    Particle particle;
    motion.start(particle, random);
    ++quadrants[(particle.velocity_m.x() > 0.0 ? 1 : 0) + (particle.velocity_m.y() > 0.0 ? 2 : 0)];
  }
  for (const int count : quadrants) EXPECT_NEAR(count, 1000, 150);
}

TEST(MotionModel, OfALinearFilterTurnsBySixtyDegrees) {
  const auto map = test::mapAt({{0.0, 0.0}, {10.0, 0.0}});
  ParticleFilterConfig config;
  config.pull = 0.0;
  const auto motion = makeMotionModel("pf_linear", config, *map);
  Random random(11);
  double cosine = 0.0;
  for (int i = 0; i < 4000; ++i) {
    Particle particle;
    particle.velocity_m = {2.0, 0.0};
    motion->move(particle, Motion(), random);
    cosine += particle.velocity_m.normalized().x() / 4000.0;
    EXPECT_NEAR(particle.velocity_m.norm(), 2.0, 0.02) << "its speed hardly changes";
    EXPECT_EQ(particle.position_m, particle.velocity_m);
  }
  EXPECT_NEAR(cosine, std::exp(-0.5 * kPi * kPi / 9.0), 0.03) << "mean cosine of a normal angle";
}

}  // namespace
}  // namespace visual_localization
