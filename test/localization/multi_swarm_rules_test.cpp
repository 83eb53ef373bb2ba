// The rules of several swarms, by a robot that stands where two places look alike.

#include <algorithm>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "localization/papers/multi_swarm.h"
#include "test/localization/twin_street.h"

namespace visual_localization {
namespace {

using test::kTwin_m;
using test::severalSwarms;
using test::TwinStreet;

/// A robot that stands where there are twins. Its matches are exact: whoever is within 3 m of a place matches as well
/// as at it.
class StandingRobot {
 public:
  explicit StandingRobot(const TrackerConfig& config, double own = 1.0, double twin = 0.9, int twins = 1)
      : street(own, twin, twins), tracker(street.map(), config, 1) {
    street.setPlateau(3.0);
    tracker.reset(around(TwinStreet::at(kPlace_m), 1.0));
  }

  TrackerEstimate look() { return see(tracker, street.from(kPlace_m)); }

  /// Looks until there are so many swarms; false if there never are.
  bool lookUntil(std::size_t swarms) {
    for (int i = 0; i < 200 && tracker.swarms() != swarms; ++i) look();
    return tracker.swarms() == swarms;
  }

  /// The same, and until all images of before are forgotten.
  bool settle(std::size_t swarms) {
    for (int i = 0; lookUntil(swarms) && i < 200; ++i) look();
    return tracker.swarms() == swarms;
  }

  std::vector<Particle> rivalsParticles() const {
    std::vector<Particle> rivals;
    for (const Particle& particle : tracker.particles()) {
      if (particle.position_m.x() > kPlace_m + 0.7 * kTwin_m) rivals.push_back(particle);
    }
    return rivals;
  }

  static constexpr double kPlace_m = 40.0;
  TwinStreet street;
  MultiSwarm tracker;
};

TEST(MultiSwarmRules, ARivalHasASeventhOfTheParticlesAndTheWeightOfItsMatches) {
  StandingRobot robot(severalSwarms());
  ASSERT_TRUE(robot.settle(2));
  EXPECT_EQ(robot.rivalsParticles().size(), 11U);
  EXPECT_NEAR(test::sumOfWeights(robot.rivalsParticles()), 0.9 / 1.9, 1e-9);
  EXPECT_NEAR(test::sumOfWeights(robot.tracker.particles()), 1.0, 1e-9);

  TrackerConfig few = severalSwarms();
  few.dpso.particles = 10;
  StandingRobot with_few(few);
  ASSERT_TRUE(with_few.lookUntil(2));
  with_few.look();
  EXPECT_EQ(with_few.rivalsParticles().size(), 2U);
  EXPECT_EQ(with_few.tracker.particles().size(), 10U);
}

TEST(MultiSwarmRules, TheImageThatFoundARivalIsItsFirst) {
  StandingRobot robot(severalSwarms());
  double weight = 0.0;
  for (int i = 0; i < 200 && robot.tracker.swarms() == 1U; ++i) weight = robot.look().report.value("rival_weight");
  ASSERT_EQ(robot.tracker.swarms(), 2U);
  robot.street.setLikeness(1.0, 0.7);
  const double strength = 0.8 * weight / (1.0 - weight) + 0.2 * 0.7;  // the leader's is 1
  EXPECT_NEAR(robot.look().report.value("rival_weight"), strength / (1.0 + strength), 1e-4);
}

TEST(MultiSwarmRules, StrengthIsAMeanInWhichTheLastImageCountsAFifth) {
  StandingRobot robot(severalSwarms());
  ASSERT_TRUE(robot.settle(2));
  EXPECT_NEAR(robot.look().report.value("rival_weight"), 0.9 / 1.9, 1e-9);
  robot.street.setLikeness(1.0, 0.7);
  EXPECT_NEAR(robot.look().report.value("rival_weight"), 0.86 / 1.86, 1e-9);
  robot.street.setLikeness(0.95, 0.9);
  EXPECT_NEAR(robot.look().report.value("rival_weight"), 0.868 / (0.99 + 0.868), 1e-9);
}

TEST(MultiSwarmRules, TheCloudIsThatOfAllSwarms) {
  StandingRobot robot(severalSwarms());
  EXPECT_LT(robot.look().cloud_covariance_m2(0, 0), 500.0);
  ASSERT_TRUE(robot.settle(2));
  const double expected_m2 = 11.0 / 80.0 * kTwin_m * kTwin_m;  // about the leader, each particle counted the same
  EXPECT_NEAR(robot.look().cloud_covariance_m2(0, 0), expected_m2, 0.3 * expected_m2);
}

TEST(MultiSwarmRules, ARivalLeadsWhenItIsATenthStronger) {
  for (const double twin : {0.86, 0.90}) {
    StandingRobot robot(severalSwarms(), 0.8, twin);
    double farthest_m = 0.0;
    std::size_t most = 0;
    for (int i = 0; i < 100; ++i) {
      farthest_m = std::max(farthest_m, robot.look().position_m.x());
      most = std::max(most, robot.tracker.swarms());
    }
    EXPECT_EQ(most, 2U) << twin;
    EXPECT_NEAR(farthest_m, StandingRobot::kPlace_m + (twin > 0.88 ? kTwin_m : 0.0), 10.0) << twin;
  }
}

TEST(MultiSwarmRules, ARivalLeadsWithItsThirdImage) {
  StandingRobot robot(severalSwarms(), 0.5, 1.0);
  ASSERT_TRUE(robot.lookUntil(2));
  EXPECT_LT(robot.look().position_m.x(), StandingRobot::kPlace_m + 10.0);
  EXPECT_GT(robot.look().position_m.x(), StandingRobot::kPlace_m + kTwin_m - 10.0);
  EXPECT_EQ(robot.rivalsParticles().size(), 69U) << "it has the leader's share";
}

TEST(MultiSwarmRules, ARivalBeginsWithinTwoMetres) {
  StandingRobot robot(severalSwarms());
  double squares_m2 = 0.0;
  double free = 0.0;
  for (int i = 0; i < 40; ++i) {
    robot.tracker.reset(around(TwinStreet::at(StandingRobot::kPlace_m), 1.0));
    ASSERT_TRUE(robot.lookUntil(2));
    const std::vector<Particle> rivals(robot.tracker.particles().end() - 11, robot.tracker.particles().end());
    double mean_m = 0.0;
    for (const Particle& particle : rivals) mean_m += particle.position_m.x() / 11.0;
    for (const Particle& particle : rivals) squares_m2 += std::pow(particle.position_m.x() - mean_m, 2);
    free += 10.0;
  }
  EXPECT_NEAR(std::sqrt(squares_m2 / free), 2.0, 0.25);
}

TEST(MultiSwarmRules, OfTwoRivalsTheStrongerOneLeads) {
  StandingRobot robot(severalSwarms(), 1.0, 0.9, 2);
  ASSERT_TRUE(robot.lookUntil(3));
  for (int i = 0; i < 3; ++i) robot.look();
  // Now the leader's place, which is the strongest, fades: the leader stays until a rival is a tenth stronger.
  robot.street.setLikeness(0.6, 0.9);
  TrackerEstimate estimate;
  for (int i = 0; i < 10; ++i) estimate = robot.look();
  EXPECT_GT(estimate.position_m.x(), StandingRobot::kPlace_m + kTwin_m - 10.0);
  EXPECT_EQ(robot.tracker.swarms(), 3U);
}

TEST(MultiSwarmRules, ARivalMustMatchHalfAsWellAsTheLeader) {
  for (const double twin : {0.45, 0.55}) {
    StandingRobot robot(severalSwarms(), 1.0, twin);
    EXPECT_EQ(robot.lookUntil(2), twin > 0.5) << twin;
  }
  TrackerConfig any = severalSwarms();
  any.dpso.rival_share = 0.01;
  StandingRobot not_recognised(any, 1.0, 0.08);
  EXPECT_FALSE(not_recognised.lookUntil(2));
}

TEST(MultiSwarmRules, ARivalThatIsNotRecognisedTwiceInARowEnds) {
  StandingRobot robot(severalSwarms());
  ASSERT_TRUE(robot.lookUntil(2));
  robot.look();
  robot.street.setLikeness(1.0, 0.0);
  robot.look();
  robot.street.setLikeness(1.0, 0.9);
  robot.look();  // again: the count begins anew
  robot.street.setLikeness(1.0, 0.0);
  robot.look();
  EXPECT_EQ(robot.tracker.swarms(), 2U);
  robot.look();
  EXPECT_EQ(robot.tracker.swarms(), 1U);
}

TEST(MultiSwarmRules, ARivalThatIsHalfAsStrongEnds) {
  TrackerConfig patient = severalSwarms();
  patient.dpso.recovery_patience = 100;
  StandingRobot robot(patient);
  ASSERT_TRUE(robot.lookUntil(2));
  robot.look();
  robot.street.setLikeness(1.0, 0.0);
  robot.look();  // 0.72
  robot.look();  // 0.576
  EXPECT_EQ(robot.tracker.swarms(), 2U);
  robot.look();  // 0.461
  EXPECT_EQ(robot.tracker.swarms(), 1U);
}

TEST(MultiSwarmRules, ARivalIsGivenTimeForThreeImages) {
  TrackerConfig strict = severalSwarms();
  strict.dpso.rival_share = 0.89;
  StandingRobot robot(strict);
  ASSERT_TRUE(robot.lookUntil(2));
  robot.street.setLikeness(1.0, 0.8);
  robot.look();  // 0.88, but with its second image
  EXPECT_EQ(robot.tracker.swarms(), 2U);
  robot.look();
  EXPECT_EQ(robot.tracker.swarms(), 1U);
}

TEST(MultiSwarmRules, SwarmsThatAreCloseBecomeOne) {
  TrackerConfig wide = severalSwarms();
  for (const double radius_m : {90.0, 110.0}) {
    StandingRobot robot(severalSwarms());
    ASSERT_TRUE(robot.lookUntil(2));
    wide.dpso.exclusion_radius_m = radius_m;
    robot.tracker.configure(wide);
    robot.look();
    EXPECT_EQ(robot.tracker.swarms(), radius_m > kTwin_m ? 1U : 2U) << radius_m;
    if (radius_m > kTwin_m) {
      EXPECT_FALSE(robot.lookUntil(2));
    }
  }
}

TEST(MultiSwarmRules, ARivalStaysOutOfThePlaceOfTheLeader) {
  TrackerConfig wide = severalSwarms();
  wide.dpso.exclusion_radius_m = 97.0;
  StandingRobot robot(wide);
  ASSERT_TRUE(robot.lookUntil(2));
  Eigen::Vector2d leader_m = robot.look().position_m;
  std::size_t rivals = 0;
  for (int i = 0; i < 50; ++i) {
    const Eigen::Vector2d now_m = robot.look().position_m;
    for (const Particle& particle : robot.rivalsParticles()) {
      ++rivals;
      EXPECT_GE((particle.position_m - leader_m).norm(), 97.0);
    }
    leader_m = now_m;
  }
  EXPECT_GT(rivals, 100U);
}

TEST(MultiSwarmRules, ALeaderThatIsLostHasAllParticles) {
  TrackerConfig without_recovery = severalSwarms();
  without_recovery.dpso.recovery = "none";
  StandingRobot robot(without_recovery);
  int lost = 0;
  for (int i = 0; i < 30; ++i) {
    robot.tracker.reset(around(TwinStreet::at(190.0), 1.0));
    while (!robot.look().best.recognised) {
      ++lost;
      ASSERT_EQ(robot.tracker.swarms(), 1U);
    }
  }
  EXPECT_GT(lost, 30);
}

TEST(MultiSwarmRules, IsDrawnToWhereItIsAttracted) {
  StandingRobot robot(severalSwarms());
  robot.look();
  verify(robot.tracker, robot.street, TwinStreet::at(170.0));
  EXPECT_EQ(see(robot.tracker, robot.street.nowhere()).position_m, TwinStreet::at(170.0));
}

TEST(MultiSwarmRules, AResetBeginsTheLeadersStrengthAnew) {
  StandingRobot robot(severalSwarms());
  const auto lookAfterReset = [&robot](double own, double twin) {
    robot.street.setLikeness(own, twin);
    robot.tracker.reset(around(TwinStreet::at(StandingRobot::kPlace_m), 1.0));
    return robot.look().report.value("rival_weight");
  };
  int at_once = 0;
  for (int i = 0; i < 400; ++i) {
    lookAfterReset(1.0, 0.0);
    const double weight = lookAfterReset(0.5, 0.45);
    if (robot.tracker.swarms() == 1U) continue;
    ++at_once;
    // A rival has matched half as well to nine tenths as well as the leader, whose images before do not count.
    EXPECT_GE(weight, 0.5 / 1.5 - 1e-9);
    EXPECT_LE(weight, 0.9 / 1.9 + 1e-9);
  }
  EXPECT_GT(at_once, 10);
}

TEST(MultiSwarmRules, OtherNumbersOfParticlesAreSharedOut) {
  StandingRobot robot(severalSwarms());
  ASSERT_TRUE(robot.lookUntil(2));
  TrackerConfig fewer = severalSwarms();
  fewer.dpso.particles = 35;
  robot.tracker.configure(fewer);
  robot.look();
  EXPECT_EQ(robot.tracker.particles().size(), 35U);
  EXPECT_EQ(robot.rivalsParticles().size(), 5U);
}

TEST(MultiSwarmRules, FewerSwarmsCanBeConfigured) {
  StandingRobot robot(severalSwarms(5), 1.0, 0.9, 2);
  ASSERT_TRUE(robot.lookUntil(3));
  robot.tracker.configure(severalSwarms(3));
  EXPECT_EQ(robot.tracker.swarms(), 3U);
  robot.tracker.configure(severalSwarms(2));
  EXPECT_EQ(robot.tracker.swarms(), 2U);
  EXPECT_EQ(robot.tracker.particles().size(), 80U);
  for (int i = 0; i < 50; ++i) {
    robot.look();
    EXPECT_LE(robot.tracker.swarms(), 2U);
  }
}

}  // namespace
}  // namespace visual_localization
