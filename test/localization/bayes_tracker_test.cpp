#include "localization/bayes_tracker.h"

#include <algorithm>
#include <cstddef>

#include <gtest/gtest.h>

#include "localization/place_filter.h"
#include "test/support/world.h"

namespace visual_localization {
namespace {

using test::onCircle;
using test::roundWorld;
using test::World;

TrackerConfig config() {
  TrackerConfig config;
  config.tracker = "bayes";
  return config;
}

TEST(BayesTracker, FindsAndFollowsARobotOnceAround) {
  World world = roundWorld();
  BayesTracker tracker(world.map(), config(), 1);
  for (int step = 0; step < 200; ++step) {
    const Eigen::Vector2d robot_m = onCircle(0.94 * step);
    const TrackerEstimate estimate = see(tracker, world.from(robot_m));
    if (step < 10) continue;
    EXPECT_LT((estimate.position_m - robot_m).norm(), 1.5) << step;
    EXPECT_LT(estimate.best_distance_m, 2.0);
    EXPECT_GT(tracker.posterior()->within(robot_m, 5.0), 0.97);
  }
}

TEST(BayesTracker, ComparesAsManyAsIsSaid) {
  World world = roundWorld();
  TrackerConfig few = config();
  few.bayes.comparisons = 40;
  few.bayes.sure_comparisons = 15;
  few.bayes.first_comparisons = 400;
  BayesTracker tracker(world.map(), few, 1);
  for (int step = 0; step < 60; ++step) {
    test::Seen input = world.from(onCircle(0.94 * step));
    see(tracker, input);
    const std::size_t comparisons = input.scores.comparisons();
    if (step == 0) {
      EXPECT_EQ(comparisons, 200U);
    }
    if (step >= 10) {
      EXPECT_LE(comparisons, 15U) << step;
    }
  }
}

TEST(BayesTracker, FindsARobotThatWasCarriedAway) {
  World world = roundWorld();
  BayesTracker tracker(world.map(), config(), 1);
  for (int step = 0; step < 30; ++step) see(tracker, world.from(onCircle(0.94 * step)));
  TrackerEstimate estimate;
  for (int step = 100; step < 130; ++step) estimate = see(tracker, world.from(onCircle(0.94 * step)));
  EXPECT_LT((estimate.position_m - onCircle(0.94 * 129)).norm(), 2.0);
}

TEST(BayesTracker, ALargeMapIsSeenByWhatLooksAlike) {
  World world(test::mapAt(test::street(2000, 1.0)));
  TrackerConfig few = config();
  few.bayes.comparisons = 40;
  few.bayes.first_comparisons = 100;
  BayesTracker tracker(world.map(), few, 1);
  TrackerEstimate estimate;
  for (int step = 0; step < 20; ++step) {
    test::Seen input = world.from({1500.0 + step, 0.0});
    estimate = see(tracker, input);
    EXPECT_LE(input.scores.comparisons(), 100u);
  }
  EXPECT_NEAR(estimate.position_m.x(), 1519.0, 2.0);
}

TEST(BayesTracker, AVerifiedPositionNeedsNoComparison) {
  World world = roundWorld();
  BayesTracker tracker(world.map(), config(), 1);
  for (int step = 0; step < 5; ++step) {
    test::Seen input = world.from(onCircle(0.0));
    input.verified_m = onCircle(40.0);
    const TrackerEstimate estimate = see(tracker, input);
    EXPECT_EQ(input.scores.comparisons(), 0u);
    EXPECT_LT((estimate.position_m - onCircle(40.0)).norm(), 2.0);
  }
}

TEST(BayesTracker, ParticlesAreDrawnFromThePosterior) {
  World world = roundWorld();
  BayesTracker tracker(world.map(), config(), 1);
  TrackerEstimate estimate;
  for (int step = 0; step < 30; ++step) estimate = see(tracker, world.from(onCircle(0.94 * step)));
  const auto near =
      std::count_if(tracker.particles().begin(), tracker.particles().end(),
                    [&](const Particle& particle) { return (particle.position_m - estimate.position_m).norm() < 5.0; });
  EXPECT_GE(static_cast<double>(near), 0.95 * static_cast<double>(tracker.particles().size()));
}

}  // namespace
}  // namespace visual_localization
