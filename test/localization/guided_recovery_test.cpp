#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "base/numbers.h"
#include "localization/papers/dpso.h"
#include "test/support/world.h"

namespace visual_localization {
namespace {

using test::onCircle;
using test::roundWorld;
using test::World;

constexpr double kHalfRound_m = 30.0 * kPi;

Dpso makeSwarm(const World& world, const std::string& recovery, std::uint32_t seed = 1, bool guided_start = true) {
  DpsoConfig config;
  config.recovery = recovery;
  config.guided_start = guided_start;
  return {world.map(), config, seed};
}

/// Whether the swarm looked where images look alike.
bool asks(Dpso& swarm, const test::Seen& input) {
  see(swarm, input);
  return input.scores.swept() > 0;
}

/// Follows a robot until it is tracked well.
void settle(Dpso& swarm, World& world) {
  for (int step = 0; step < 60; ++step) see(swarm, world.from(onCircle(0.0)));
}

/// Images from the kidnapping until the error is below 3 m; `most` when that is not in time.
int imagesUntilFound(const std::string& recovery, std::uint32_t seed, int most) {
  World world = roundWorld();
  Dpso swarm = makeSwarm(world, recovery, seed);
  settle(swarm, world);
  for (int image = 1; image < most; ++image) {
    const Eigen::Vector2d robot = onCircle(kHalfRound_m + 0.6 * image);
    if ((see(swarm, world.from(robot)).position_m - robot).norm() < 3.0) return image;
  }
  return most;
}

TEST(GuidedRecovery, FindsAKidnappedRobotSoonerThanThePapers) {
  for (std::uint32_t seed = 1; seed <= 12; ++seed) {
    const int guided = imagesUntilFound("guided", seed, 100);
    EXPECT_LE(guided, 5) << seed;
    EXPECT_GT(imagesUntilFound("paper", seed, 100), guided) << seed;
  }
}

TEST(GuidedRecovery, AsksOnlyWhenThePositionIsTakenToBeLost) {
  World world = roundWorld();
  Dpso swarm = makeSwarm(world, "guided");
  settle(swarm, world);
  for (int step = 0; step < 20; ++step) EXPECT_FALSE(asks(swarm, world.from(onCircle(0.0)))) << step;
  EXPECT_FALSE(asks(swarm, world.inTheDark()));
  EXPECT_FALSE(asks(swarm, world.inTheDark())) << "the patience ends after this image";
  for (int step = 0; step < 3; ++step) EXPECT_TRUE(asks(swarm, world.inTheDark())) << step;
  EXPECT_TRUE(asks(swarm, world.from(onCircle(0.0)))) << "not recognised before this image";
  EXPECT_FALSE(asks(swarm, world.from(onCircle(0.0))));
}

TEST(GuidedRecovery, TheOtherRecoveriesNeverAsk) {
  for (const char* recovery : {"paper", "none"}) {
    World world = roundWorld();
    Dpso swarm = makeSwarm(world, recovery);
    for (int step = 0; step < 30; ++step) {
      EXPECT_FALSE(asks(swarm, step % 10 < 6 ? world.inTheDark() : world.from(onCircle(0.6 * step))));
    }
    swarm.reset(anywhere(world.map().area()));
    EXPECT_FALSE(asks(swarm, world.inTheDark()));
  }
}

TEST(GuidedRecovery, TheStartIsGuidedUntilAnImageIsRecognised) {
  World world = roundWorld();
  Dpso swarm = makeSwarm(world, "guided");
  for (int step = 0; step < 2; ++step) EXPECT_TRUE(asks(swarm, world.inTheDark()));
  for (int step = 0; step < 3; ++step) see(swarm, world.from(onCircle(0.0)));
  EXPECT_FALSE(asks(swarm, world.from(onCircle(0.0))));
  EXPECT_FALSE(asks(swarm, world.inTheDark())) << "the start is over";
  swarm.reset(anywhere(world.map().area()));
  EXPECT_TRUE(asks(swarm, world.from(onCircle(0.0))));
}

TEST(GuidedRecovery, AStartWithAPriorOrWithoutGuidanceIsNotGuided) {
  World world = roundWorld();
  Dpso swarm = makeSwarm(world, "guided");
  swarm.reset(around(onCircle(0.0), 5.0));
  EXPECT_FALSE(asks(swarm, world.inTheDark()));
  Dpso unguided = makeSwarm(world, "guided", 1, false);
  EXPECT_FALSE(asks(unguided, world.inTheDark()));
  EXPECT_FALSE(asks(unguided, world.inTheDark()));
  EXPECT_TRUE(asks(unguided, world.inTheDark())) << "lost in the meantime, as after any bad images";
}

TEST(GuidedRecovery, OnlyQuantumParticlesGoWhereTheImageLooksAlike) {
  World world = roundWorld();
  Dpso swarm = makeSwarm(world, "guided");
  const std::vector<Particle> before = swarm.particles();
  const test::Seen input = world.inTheDark();
  input.scores.startImage(FeatureKind::kLocal, [](FeatureKind kind, std::size_t image) {
    return kind == FeatureKind::kGlobal && image == 77 ? World::scoreAt(1.0) : Score{};
  });
  see(swarm, input);
  for (std::size_t i = 0; i < before.size(); ++i) {
    const bool quantum = before[i].kind == ParticleKind::kQuantum;
    EXPECT_EQ(swarm.particles()[i].position_m, quantum ? world.map().image(77).position_m : before[i].position_m);
  }
}

}  // namespace
}  // namespace visual_localization
