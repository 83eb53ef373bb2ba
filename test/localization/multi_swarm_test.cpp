// Several swarms where two places look alike.

#include "localization/papers/multi_swarm.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "test/localization/twin_street.h"

namespace visual_localization {
namespace {

using test::kTwin_m;
using test::severalSwarms;
using test::TwinStreet;

constexpr double kEvery_m = 1.0;

/// How many of the images from 20 to 60 m have an estimate at the twin, by a tracker that begins there.
int imagesAtTwin(Tracker& tracker, TwinStreet& street) {
  tracker.reset(around(TwinStreet::at(20.0 + kTwin_m), 3.0));
  int wrong = 0;
  for (double along_m = 20.0; along_m < 60.0; along_m += kEvery_m) {
    const TrackerEstimate estimate = see(tracker, street.from(along_m));
    if (std::abs(estimate.position_m.x() - along_m) > 5.0) ++wrong;
  }
  return wrong;
}

TEST(MultiSwarm, LeavesTheTwinForThePlaceThatMatchesBetter) {
  TwinStreet street(1.0, 0.8);
  int by_one = 0;
  int by_several = 0;
  for (std::uint32_t seed = 1; seed <= 20; ++seed) {
    Dpso one(street.map(), DpsoConfig(), seed);
    MultiSwarm several(street.map(), severalSwarms(), seed);
    by_one += imagesAtTwin(one, street);
    by_several += imagesAtTwin(several, street);
  }
  EXPECT_LT(2 * by_several, by_one);
}

TEST(MultiSwarm, ARivalFollowsTheTwinAndEndsWithIt) {
  TwinStreet street(1.0, 0.9);
  MultiSwarm tracker(street.map(), severalSwarms(), 1);
  tracker.reset(around(TwinStreet::at(0.0), 3.0));
  double most_weight = 0.0;
  for (double along_m = 0.0; along_m < 60.0; along_m += kEvery_m) {
    const TrackerEstimate estimate = see(tracker, street.from(along_m));
    if (along_m < 20.0) {
      EXPECT_EQ(estimate.report.value("rival_weight"), 0.0) << along_m;
    }
    if (along_m > 30.0) {
      EXPECT_EQ(tracker.swarms(), 2U) << along_m;
    }
    EXPECT_LT((estimate.position_m - TwinStreet::at(along_m)).norm(), 5.0) << along_m;
    most_weight = std::max(most_weight, estimate.report.value("rival_weight"));
  }
  EXPECT_GT(most_weight, 0.4);
  EXPECT_LT(most_weight, 0.55);
  TrackerEstimate estimate;
  for (double along_m = 60.0; along_m < 75.0; along_m += kEvery_m) estimate = see(tracker, street.from(along_m));
  EXPECT_EQ(tracker.swarms(), 1U);
  EXPECT_EQ(estimate.report.value("rival_weight"), 0.0);
}

TEST(MultiSwarm, TheNumberOfParticlesStays) {
  TwinStreet street(1.0, 0.9);
  MultiSwarm tracker(street.map(), severalSwarms(5), 1);
  std::size_t most = 0;
  for (double along_m = 0.0; along_m < 100.0; along_m += kEvery_m) {
    see(tracker, street.from(along_m));
    ASSERT_EQ(tracker.particles().size(), 80U);
    most = std::max(most, tracker.swarms());
  }
  EXPECT_GT(most, 1U);
}

TEST(MultiSwarm, AVerifiedPoseAndAResetEndAllRivals) {
  TwinStreet street(1.0, 0.9);
  MultiSwarm tracker(street.map(), severalSwarms(), 1);
  const auto drive = [&] {
    tracker.reset(around(TwinStreet::at(15.0), 3.0));
    for (double along_m = 15.0; along_m < 45.0; along_m += kEvery_m) see(tracker, street.from(along_m));
  };
  drive();
  ASSERT_GT(tracker.swarms(), 1U);
  test::Seen verified = street.from(45.0);
  verified.verified_m = TwinStreet::at(45.0);
  EXPECT_EQ(see(tracker, verified).report.value("rival_weight"), 0.0);
  EXPECT_EQ(tracker.swarms(), 1U);
  drive();
  ASSERT_GT(tracker.swarms(), 1U);
  tracker.reset(anywhere(street.map().area()));
  EXPECT_EQ(tracker.swarms(), 1U);
}

TEST(MultiSwarm, StaysAtThePlaceAfterVerifiedPoses) {
  TwinStreet street(1.0, 0.8);
  Dpso one(street.map(), DpsoConfig(), 1);
  MultiSwarm several(street.map(), severalSwarms(), 1);
  one.reset(anywhere(street.map().area()));  // as the several do at their start: both draw the same
  for (Tracker* tracker : {static_cast<Tracker*>(&one), static_cast<Tracker*>(&several)}) {
    tracker->reset(around(TwinStreet::at(0.0), 3.0));
  }
  for (double along_m = 0.0; along_m < 25.0; along_m += kEvery_m) {
    test::Seen verified = street.from(along_m);
    verified.verified_m = TwinStreet::at(along_m);
    const TrackerEstimate expected = see(one, verified);
    EXPECT_NEAR(see(several, verified).spread_m.x(), expected.spread_m.x(), 1e-9) << along_m;
  }
  for (double along_m = 25.0; along_m < 60.0; along_m += kEvery_m) {
    const TrackerEstimate estimate = see(several, street.from(along_m));
    EXPECT_LT((estimate.position_m - TwinStreet::at(along_m)).norm(), 5.0) << along_m;
    EXPECT_LT(estimate.report.value("rival_weight"), 0.55) << along_m;
  }
}

}  // namespace
}  // namespace visual_localization
