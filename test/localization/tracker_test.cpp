#include "visual_localization/localization/tracker.h"

#include <algorithm>
#include <memory>
#include <string>

#include <gtest/gtest.h>

#include "test/support/world.h"

namespace visual_localization {
namespace {

using test::onCircle;
using test::roundWorld;
using test::World;

/// What holds for every tracker.
class TrackerTest : public ::testing::TestWithParam<const char*> {
 protected:
  static std::unique_ptr<Tracker> makeTracker(const World& world, std::uint32_t seed) {
    TrackerConfig config;
    config.tracker = GetParam();
    return visual_localization::makeTracker(world.map(), config, seed);
  }
};

INSTANTIATE_TEST_SUITE_P(Trackers, TrackerTest,
                         ::testing::Values("dpso", "dpso_multi", "pf_gaussian", "pf_linear", "bayes"),
                         [](const auto& tracker) { return std::string(tracker.param); });

TEST_P(TrackerTest, TheSameSeedGivesTheSameTrack) {
  World world = roundWorld();
  const auto first = makeTracker(world, 3);
  const auto second = makeTracker(world, 3);
  const auto other = makeTracker(world, 4);
  bool differs = false;
  for (int step = 0; step < 30; ++step) {
    const auto seen = [&] { return step % 8 == 7 ? world.inTheDark() : world.from(onCircle(0.6 * step)); };
    const Eigen::Vector2d position = see(*first, seen()).position_m;
    EXPECT_EQ(position, see(*second, seen()).position_m);
    see(*other, seen());
    for (std::size_t i = 0; i < first->particles().size(); ++i) {
      EXPECT_EQ(first->particles()[i].position_m, second->particles()[i].position_m);
      differs = differs || first->particles()[i].position_m != other->particles()[i].position_m;
    }
  }
  EXPECT_TRUE(differs);
}

TEST_P(TrackerTest, WeightsSumToOneWhateverIsSeen) {
  World world = roundWorld();
  const auto tracker = makeTracker(world, 2);
  const std::size_t count = tracker->particles().size();
  for (int step = 0; step < 50; ++step) {
    const TrackerEstimate estimate =
        see(*tracker, step % 5 == 4 ? world.inTheDark() : world.from(onCircle(0.6 * step)));
    EXPECT_TRUE(estimate.position_m.allFinite());
    EXPECT_NEAR(test::sumOfWeights(tracker->particles()), 1.0, 1e-9);
    EXPECT_EQ(tracker->particles().size(), count);
    for (const Particle& particle : tracker->particles()) {
      ASSERT_TRUE(particle.position_m.allFinite());
      ASSERT_GE(particle.weight, 0.0);
    }
  }
}

TEST_P(TrackerTest, ResetDrawsFromThePriorAndWithoutOneFromTheWholeMap) {
  World world = roundWorld();
  const auto tracker = makeTracker(world, 1);
  for (int step = 0; step < 20; ++step) see(*tracker, world.from(onCircle(0.0)));
  const Eigen::Vector2d centre_m = onCircle(5.0);
  tracker->reset(around(centre_m, 2.0));
  const auto reach_m = [&] {
    double farthest_m = 0.0;
    for (const Particle& particle : tracker->particles()) {
      farthest_m = std::max(farthest_m, (particle.position_m - centre_m).norm());
    }
    return farthest_m;
  };
  const double to_a_training_image_m = GetParam() == std::string("bayes") ? 2.0 : 0.0;
  EXPECT_LE(reach_m(), 2.0 + to_a_training_image_m);
  tracker->reset(anywhere(world.map().area()));
  EXPECT_GT(reach_m(), 40.0);
}

}  // namespace
}  // namespace visual_localization
