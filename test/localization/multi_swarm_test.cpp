// Several swarms where two places look alike.

#include "localization/multi_swarm.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include <gtest/gtest.h>

#include "localization/session_choice.h"
#include "test/support/world.h"

namespace visual_localization {
namespace {

using test::World;

constexpr double kStep_m = 1.0;
constexpr double kTwin_m = 100.0;  ///< from a place of the first row to its twin in the second

/// A straight street of 200 m with an image a metre. From 20 to 60 m it looks as it does from 120 to 160 m, almost:
/// what is seen there matches its own place by `own` and its twin by `twin`.
class TwinStreet {
 public:
  TwinStreet(double own, double twin)
      : own_(own),
        twin_(twin),
        map_(test::mapAt(test::street(200, 1.0))),
        scores_(map_->size()),
        sweep_(*map_, 100000, 100000),
        sessions_(*map_, false) {}

  static Eigen::Vector2d at(double along_m) { return {along_m, 0.0}; }

  TrackerInput from(double along_m) {
    scores_.startImage(FeatureKind::kSift, [this, along_m](FeatureKind kind, std::size_t image) {
      const double wide_m = kind == FeatureKind::kSift ? 2.0 : 5.0;
      const double place_m = map_->position_m(image).x();
      const bool twins = along_m >= 20.0 && along_m < 60.0;
      const double like_own = (twins ? own_ : 1.0) * bell(place_m - along_m, wide_m);
      const double like_twin = twins ? twin_ * bell(place_m - along_m - kTwin_m, wide_m) : 0.0;
      return World::scoreAt(0.5 * std::max(like_own, like_twin));
    });
    sweep_.startImage();
    return {scores_, sweep_, sessions_};
  }

  const TrainingMap& map() const { return *map_; }

 private:
  static double bell(double apart_m, double width_m) {
    return std::exp(-0.5 * apart_m * apart_m / (width_m * width_m));
  }

  double own_;
  double twin_;
  std::shared_ptr<const TrainingMap> map_;
  Scores scores_;
  MapSweep sweep_;
  SessionChoice sessions_;
};

TrackerConfig config(int swarms = 3) {
  TrackerConfig config;
  config.tracker = "dpso_multi";
  config.dpso.swarms = swarms;
  return config;
}

/// How many of the images from 20 to 60 m have an estimate at the twin, by a tracker that begins there.
int imagesAtTwin(Tracker& tracker, TwinStreet& street) {
  tracker.reset(around(TwinStreet::at(20.0 + kTwin_m), 3.0));
  int wrong = 0;
  for (double along_m = 20.0; along_m < 60.0; along_m += kStep_m) {
    const TrackerEstimate estimate = tracker.update(street.from(along_m));
    if (std::abs(estimate.position_m.x() - along_m) > 5.0) ++wrong;
  }
  return wrong;
}

TEST(MultiSwarm, LeavesTheTwinForThePlaceThatMatchesBetter) {
  TwinStreet street(1.0, 0.8);
  int by_one = 0;
  int by_several = 0;
  for (std::uint32_t seed = 1; seed <= 20; ++seed) {
    Dpso one(street.map(), DpsoConfig(), FitnessConfig(), seed);
    MultiSwarm several(street.map(), config(), seed);
    by_one += imagesAtTwin(one, street);
    by_several += imagesAtTwin(several, street);
  }
  EXPECT_LT(2 * by_several, by_one);
}

TEST(MultiSwarm, ARivalFollowsTheTwinAndEndsWithIt) {
  TwinStreet street(1.0, 0.9);
  MultiSwarm tracker(street.map(), config(), 1);
  tracker.reset(around(TwinStreet::at(0.0), 3.0));
  double most_weight = 0.0;
  for (double along_m = 0.0; along_m < 60.0; along_m += kStep_m) {
    const TrackerEstimate estimate = tracker.update(street.from(along_m));
    if (along_m < 20.0) {
      EXPECT_EQ(estimate.rival_weight, 0.0) << along_m;
    }
    if (along_m > 30.0) {
      EXPECT_EQ(tracker.swarms(), 2U) << along_m;
    }
    EXPECT_LT((estimate.position_m - TwinStreet::at(along_m)).norm(), 5.0) << along_m;
    most_weight = std::max(most_weight, estimate.rival_weight);
  }
  EXPECT_GT(most_weight, 0.4);
  EXPECT_LT(most_weight, 0.55);
  TrackerEstimate estimate;
  for (double along_m = 60.0; along_m < 75.0; along_m += kStep_m) estimate = tracker.update(street.from(along_m));
  EXPECT_EQ(tracker.swarms(), 1U);
  EXPECT_EQ(estimate.rival_weight, 0.0);
}

TEST(MultiSwarm, TheNumberOfParticlesStays) {
  TwinStreet street(1.0, 0.9);
  MultiSwarm tracker(street.map(), config(5), 1);
  std::size_t most = 0;
  for (double along_m = 0.0; along_m < 100.0; along_m += kStep_m) {
    tracker.update(street.from(along_m));
    ASSERT_EQ(tracker.particles().size(), 80U);
    most = std::max(most, tracker.swarms());
  }
  EXPECT_GT(most, 1U);
}

TEST(MultiSwarm, AVerifiedPoseAndAResetEndAllRivals) {
  TwinStreet street(1.0, 0.9);
  MultiSwarm tracker(street.map(), config(), 1);
  const auto drive = [&] {
    tracker.reset(around(TwinStreet::at(15.0), 3.0));
    for (double along_m = 15.0; along_m < 45.0; along_m += kStep_m) tracker.update(street.from(along_m));
  };
  drive();
  ASSERT_GT(tracker.swarms(), 1U);
  TrackerInput verified = street.from(45.0);
  verified.verified_m = TwinStreet::at(45.0);
  EXPECT_EQ(tracker.update(verified).rival_weight, 0.0);
  EXPECT_EQ(tracker.swarms(), 1U);
  drive();
  ASSERT_GT(tracker.swarms(), 1U);
  tracker.reset();
  EXPECT_EQ(tracker.swarms(), 1U);
}

TEST(MultiSwarm, StaysAtThePlaceAfterVerifiedPoses) {
  TwinStreet street(1.0, 0.8);
  Dpso one(street.map(), DpsoConfig(), FitnessConfig(), 1);
  MultiSwarm several(street.map(), config(), 1);
  one.reset();  // as the several do at their start: both draw the same
  for (Tracker* tracker : {static_cast<Tracker*>(&one), static_cast<Tracker*>(&several)}) {
    tracker->reset(around(TwinStreet::at(0.0), 3.0));
  }
  for (double along_m = 0.0; along_m < 25.0; along_m += kStep_m) {
    TrackerInput verified = street.from(along_m);
    verified.verified_m = TwinStreet::at(along_m);
    const TrackerEstimate expected = one.update(verified);
    EXPECT_NEAR(several.update(verified).spread_m.x(), expected.spread_m.x(), 1e-9) << along_m;
  }
  for (double along_m = 25.0; along_m < 60.0; along_m += kStep_m) {
    const TrackerEstimate estimate = several.update(street.from(along_m));
    EXPECT_LT((estimate.position_m - TwinStreet::at(along_m)).norm(), 5.0) << along_m;
    EXPECT_LT(estimate.rival_weight, 0.55) << along_m;
  }
}

TEST(MultiSwarm, FewerSwarmsCanBeConfigured) {
  TwinStreet street(1.0, 0.9);
  MultiSwarm tracker(street.map(), config(5), 1);
  for (double along_m = 0.0; along_m < 45.0; along_m += kStep_m) tracker.update(street.from(along_m));
  tracker.configure(config(2));
  EXPECT_LE(tracker.swarms(), 2U);
  EXPECT_EQ(tracker.particles().size(), 80U);
}

}  // namespace
}  // namespace visual_localization
