#include "localization/session_choice.h"

#include <cmath>
#include <memory>
#include <optional>
#include <set>
#include <vector>

#include <gtest/gtest.h>

#include "localization/papers/dpso.h"
#include "test/support/synthetic.h"
#include "test/support/world.h"

namespace visual_localization {
namespace {

constexpr std::int64_t kHour_ns = 3'600'000'000'000;

/// A street along x, an image every 2 m, once at 8, at 13 and at 18 o'clock; the last session has only its second half.
std::shared_ptr<const TrainingMap> threeHours() {
  MapHeader header;
  header.image_size = {320, 240};
  header.sessions = {{"morning"}, {"noon"}, {"evening"}};
  std::vector<TrainingImage> images;
  for (int session = 0; session < 3; ++session) {
    for (int i = session == 2 ? 25 : 0; i < 50; ++i) {
      TrainingImage image;
      image.stamp_ns = (8 + 5 * session) * kHour_ns + i * 1'000'000'000LL;
      image.session = session;
      image.position_m = {2.0 * i, 0.1 * session};
      images.push_back(image);
    }
  }
  return std::make_shared<const TrainingMap>(header, images);
}

class SessionChoiceTest : public testing::Test {
 protected:
  int sessionAt(const Eigen::Vector2d& position_m) const {
    return map_->pose(sessions_.nearest(position_m).image).session;
  }
  /// The next images until another session is to be tried at x = 80 m; its training image.
  std::size_t nextTrial() {
    for (int i = 0; i < 10; ++i) {
      sessions_.startImage(8 * kHour_ns);
      const auto trial = sessions_.trial({80.0, 0.0}, 0.0);
      if (trial) return *trial;
    }
    ADD_FAILURE() << "nothing was tried in ten images";
    return 0;
  }

  std::shared_ptr<const TrainingMap> map_ = threeHours();
  SessionChoice sessions_{*map_, true};
};

TEST_F(SessionChoiceTest, BeginsWithTheNearestTimeOfDay) {
  sessions_.startImage((24 * 1000 + 12) * kHour_ns);
  EXPECT_EQ(sessions_.chosen(), 1U);
  EXPECT_EQ(sessionAt({80.0, 0.0}), 1);
}

TEST_F(SessionChoiceTest, TheDayBeginsAgainAtMidnight) {
  sessions_.startImage((24 * 1000 + 1) * kHour_ns);  // 7 h after 18 o'clock, 7 h before 8: the later recording
  EXPECT_EQ(sessions_.chosen(), 2U);
}

TEST_F(SessionChoiceTest, TakesAnotherSessionWhereTheChosenOneWasNot) {
  sessions_.startImage(18 * kHour_ns);
  EXPECT_EQ(sessionAt({80.0, 0.0}), 2);
  EXPECT_NE(sessionAt({20.0, 0.0}), 2);
  for (const std::size_t image : sessions_.around({80.0, 0.0}, 0.0, 5)) EXPECT_EQ(map_->pose(image).session, 2);
  for (const std::size_t image : sessions_.around({20.0, 0.0}, 0.0, 5)) EXPECT_NE(map_->pose(image).session, 2);
}

TEST_F(SessionChoiceTest, LooksAroundLikeATrainingImage) {
  sessions_.startImage(8 * kHour_ns);
  const std::size_t of_noon = 60;
  ASSERT_EQ(map_->pose(of_noon).session, 1);
  for (const std::size_t image : sessions_.aroundLike(of_noon, 5)) EXPECT_EQ(map_->pose(image).session, 1);
}

TEST_F(SessionChoiceTest, LooksAroundInAllSessions) {
  sessions_.startImage(8 * kHour_ns);
  std::set<int> seen;
  for (const std::size_t image : sessions_.aroundAny({80.0, 0.1}, 0.0, 3)) seen.insert(map_->pose(image).session);
  EXPECT_EQ(seen.size(), 3U);
}

TEST_F(SessionChoiceTest, FindsNothingThatFacesAnotherWay) {
  sessions_.startImage(8 * kHour_ns);
  EXPECT_TRUE(sessions_.around({80.0, 0.0}, 3.1, 5).empty());
  EXPECT_TRUE(sessions_.aroundAny({80.0, 0.0}, 3.1, 5).empty());
}

TEST_F(SessionChoiceTest, ChoosesTheSessionThatMatchesBetter) {
  sessions_.startImage(8 * kHour_ns);
  ASSERT_EQ(sessions_.chosen(), 0U);
  for (int i = 0; i < 8 && *sessions_.chosen() == 0; ++i) {
    const std::size_t trial = nextTrial();
    sessions_.learn(40, 20, trial, map_->pose(trial).session == 1 ? 60 : 10);
  }
  EXPECT_EQ(sessions_.chosen(), 1U);
}

TEST_F(SessionChoiceTest, StaysWithWhatMatchesAsWell) {
  sessions_.startImage(8 * kHour_ns);
  for (int i = 0; i < 20; ++i) sessions_.learn(40, 20, nextTrial(), 20);
  EXPECT_EQ(sessions_.chosen(), 0U);
}

TEST_F(SessionChoiceTest, TriesOneSessionInAnImage) {
  nextTrial();
  EXPECT_EQ(sessions_.trial({80.0, 0.0}, 0.0), sessions_.trial({80.0, 0.0}, 0.0));
}

TEST_F(SessionChoiceTest, TriesTheOthersWhenNothingIsSeen) {
  sessions_.startImage(8 * kHour_ns);
  sessions_.noteRecognition(false);
  sessions_.noteRecognition(false);
  EXPECT_EQ(sessions_.chosen(), 0U) << "one bad image says nothing about the light";
  std::vector<bool> asked(3);
  for (int i = 0; i < 6; ++i) {
    sessions_.noteRecognition(false);
    asked[*sessions_.chosen()] = true;
  }
  EXPECT_EQ(asked, std::vector<bool>(3, true));
}

TEST_F(SessionChoiceTest, ReturnsToTheSessionOfTheHourWhileNothingIsSeen) {
  sessions_.startImage(18 * kHour_ns);
  ASSERT_EQ(sessions_.chosen(), 2U);
  int of_the_hour = 0;
  for (int i = 0; i < 12; ++i) {
    sessions_.noteRecognition(false);
    of_the_hour += sessions_.chosen() == 2U ? 1 : 0;
  }
  EXPECT_GE(of_the_hour, 6);
}

TEST_F(SessionChoiceTest, ImagesThatShowNothingCountInARow) {
  sessions_.startImage(18 * kHour_ns);
  for (int i = 0; i < 20; ++i) {
    sessions_.noteRecognition(false);
    sessions_.noteRecognition(false);
    sessions_.noteRecognition(true);
  }
  EXPECT_EQ(sessions_.chosen(), 2U);
}

TEST_F(SessionChoiceTest, LooksAtTheHourWhenItIsSwitchedOn) {
  sessions_.configure(false);
  sessions_.startImage(18 * kHour_ns);
  sessions_.configure(true);
  sessions_.startImage(18 * kHour_ns);
  EXPECT_EQ(sessions_.chosen(), 2U);
}

TEST_F(SessionChoiceTest, StaysWithTheSessionOfAVerifiedPose) {
  sessions_.startImage(8 * kHour_ns);
  for (int i = 0; i < 4; ++i) sessions_.learn(40, 20, nextTrial(), 19);
  sessions_.choose(110);
  ASSERT_EQ(sessions_.chosen(), 2U);
  sessions_.learn(110, 20, 40, 20);
  EXPECT_EQ(sessions_.chosen(), 2U);
}

TEST_F(SessionChoiceTest, ChoosesNothingWhenItIsOff) {
  sessions_.configure(false);
  sessions_.startImage(8 * kHour_ns);
  EXPECT_EQ(sessions_.chosen(), std::nullopt);
  EXPECT_EQ(sessions_.trial({80.0, 0.0}, 0.0), std::nullopt);
  for (const double x_m : {3.0, 41.0, 97.0}) {
    EXPECT_EQ(sessions_.nearest({x_m, 0.0}).image, map_->nearest({x_m, 0.0}).image);
  }
}

TEST(SessionChoice, AtTheSameTimeOfDayTheNewerOneIsChosen) {
  MapHeader header;
  header.image_size = {320, 240};
  header.sessions = {{"old"}, {"new"}, {"older"}};
  constexpr std::int64_t kDay_ns = 24 * kHour_ns;
  std::vector<TrainingImage> images;
  for (const int day : {3, 5, 1}) {
    TrainingImage image;
    image.stamp_ns = day * kDay_ns + 10 * kHour_ns;
    image.session = static_cast<int>(images.size());
    image.position_m = {1.0 * static_cast<double>(images.size()), 0.0};
    images.push_back(image);
  }
  const TrainingMap map(header, images);
  SessionChoice sessions(map, true);
  sessions.startImage(9 * kDay_ns + 11 * kHour_ns);
  EXPECT_EQ(sessions.chosen(), 1U);
  sessions.startImage(9 * kDay_ns + 23 * kHour_ns);
  EXPECT_EQ(sessions.chosen(), 1U) << "only the first image asks for the hour";
}

TEST(SessionChoice, TheFirstImageOfTheMapCountsAsAnyOther) {
  MapHeader header;
  header.image_size = {320, 240};
  header.sessions = {{"morning"}, {"evening"}};
  std::vector<TrainingImage> images(2);
  images[0].stamp_ns = 8 * kHour_ns;
  images[1].stamp_ns = 18 * kHour_ns;
  images[1].session = 1;
  const TrainingMap map(header, images);
  SessionChoice sessions(map, true);
  sessions.startImage(9 * kHour_ns);
  EXPECT_EQ(sessions.chosen(), 0U);
}

/// Images until a session that matches `ratio` times as well as the first one is chosen; 100: never.
int imagesUntilChosen(double ratio) {
  const auto map = threeHours();
  SessionChoice sessions(*map, true);
  sessions.startImage(8 * kHour_ns);
  for (int images = 1; images < 100; ++images) {
    sessions.learn(30, 0.1, 80, 0.1 * ratio);
    if (sessions.chosen() == 1U) return images;
  }
  return 100;
}

// What is known of it is 1, then 0.7 of that and 0.3 of (0.1 ratio + 0.01) / 0.11, and so on; it must exceed 1.1.
TEST(SessionChoice, AMuchBetterMatchIsBelievedSooner) {
  EXPECT_EQ(imagesUntilChosen(1.0), 100);
  EXPECT_EQ(imagesUntilChosen(1.1), 100) << "no better than 1.09";
  EXPECT_EQ(imagesUntilChosen(1.2), 3);
  EXPECT_EQ(imagesUntilChosen(2.0), 1);
}

TEST_F(SessionChoiceTest, ChangesAsReadilyAfterManyChanges) {
  sessions_.startImage(8 * kHour_ns);
  for (int change = 0; change < 500; ++change) {  // as on a course of which each half matches one of two sessions
    const std::size_t before = *sessions_.chosen();
    const std::size_t image = before == 0 ? 30 : 80;
    const std::size_t other = before == 0 ? 80 : 30;
    for (int trial = 0; trial < 3 && sessions_.chosen() == before; ++trial) sessions_.learn(image, 0.1, other, 0.2);
    ASSERT_NE(sessions_.chosen(), before) << change;
  }
}

TEST_F(SessionChoiceTest, TheOrderOfTrials) {
  sessions_.startImage(8 * kHour_ns);
  const auto sessionsTried = [this](int trials) {
    std::vector<int> tried;
    for (int i = 0; i < trials; ++i) tried.push_back(map_->pose(nextTrial()).session);
    return tried;
  };
  EXPECT_EQ(sessionsTried(4), (std::vector<int>{1, 2, 1, 2})) << "beside the first one the others in turn";
  sessions_.choose(70);
  ASSERT_EQ(sessions_.chosen(), 1U);
  EXPECT_EQ(sessionsTried(4), (std::vector<int>{0, 0, 2, 0})) << "beside another one the first one every second time";
}

TEST_F(SessionChoiceTest, EveryFourthImageIsATrial) {
  for (int image = 1; image <= 12; ++image) {
    sessions_.startImage(8 * kHour_ns);
    EXPECT_EQ(sessions_.trial({80.0, 0.0}, 0.0).has_value(), image % 4 == 0) << image;
  }
}

TEST_F(SessionChoiceTest, ATrialIsNearAndFacesAlike) {
  const auto nearestTrial = [this](double x_m) {
    for (int i = 0; i < 4; ++i) {
      sessions_.startImage(8 * kHour_ns);
      const auto trial = sessions_.trial({x_m, 0.0}, 0.0);
      if (trial) return map_->position_m(*trial).x();
    }
    return -1.0;
  };
  EXPECT_EQ(nearestTrial(20.4), 20.0) << "of the session at noon";
  EXPECT_EQ(nearestTrial(20.4), -1.0) << "in the evening it was not there";
}

TEST_F(SessionChoiceTest, WhileNothingIsSeenTheBestAndTheOthersTakeTurns) {
  sessions_.startImage(13 * kHour_ns);
  ASSERT_EQ(sessions_.chosen(), 1U);
  std::vector<std::size_t> chosen;
  for (int i = 0; i < 8; ++i) {
    sessions_.noteRecognition(false);
    chosen.push_back(*sessions_.chosen());
  }
  EXPECT_EQ(chosen[0], 1U);
  EXPECT_EQ(chosen[1], 1U);
  for (const std::size_t i : {3U, 5U, 7U}) EXPECT_EQ(chosen[i], 1U) << "the session before";
  EXPECT_NE(chosen[2], 1U);
  EXPECT_NE(chosen[4], 1U);
}

TEST_F(SessionChoiceTest, OneImageThatMatchesNothingIsNotTheLastWord) {
  sessions_.startImage(8 * kHour_ns);
  sessions_.learn(30, 1.0, 80, 0.0);  // noon: a tenth at least, so 0.73 is left of 1
  sessions_.learn(30, 0.1, 80, 0.21);
  EXPECT_EQ(sessions_.chosen(), 1U) << "0.7 * 0.73 + 0.3 * 2 is more than 1.1";
}

TEST_F(SessionChoiceTest, WhatIsChosenCountsAsTheBest) {
  sessions_.startImage(8 * kHour_ns);
  sessions_.learn(30, 1.0, 80, 0.0);
  sessions_.choose(80);
  ASSERT_EQ(sessions_.chosen(), 1U);
  for (int i = 0; i < 4; ++i) sessions_.noteRecognition(false);
  EXPECT_EQ(sessions_.chosen(), 1U) << "the fourth time the best one is asked";
}

TEST_F(SessionChoiceTest, AReachOfThreeMetres) {
  sessions_.startImage(18 * kHour_ns);  // the evening begins at x = 50 m
  ASSERT_EQ(sessions_.chosen(), 2U);
  const auto nearestAt = [this](double x_m) {
    return map_->pose(sessions_.around({x_m, 0.0}, 0.0, 3).front()).session;
  };
  EXPECT_EQ(nearestAt(47.5), 2) << "2.5 m away, the others half a metre";
  EXPECT_NE(nearestAt(45.5), 2) << "4.5 m away, the others half a metre";
}

/// A swarm on a round with two sessions of which one shows today's light.
TEST(SessionChoice, ASwarmComparesWithOneSession) {
  MapHeader header;
  header.image_size = {320, 240};
  header.sessions = {{"dark"}, {"bright"}};
  std::vector<TrainingImage> images;
  const std::vector<Eigen::Vector2d> round = test::circle(200, 30.0);
  for (int session = 0; session < 2; ++session) {
    for (std::size_t i = 0; i < round.size(); ++i) {
      TrainingImage image;
      image.stamp_ns = static_cast<std::int64_t>(i) * 1'000'000'000;
      image.session = session;
      image.position_m = round[i] * (session == 0 ? 1.0 : 1.01);
      const Eigen::Vector2d along = round[(i + 1) % round.size()] - round[i];
      image.yaw_rad = std::atan2(along.y(), along.x());
      images.push_back(image);
    }
  }
  const TrainingMap map(header, images);
  const auto meanComparisons = [&](bool choose) {
    SessionChoice sessions(map, choose);
    Scores scores(map.size());
    MapSweep sweep(map, 100000, 100000);
    ImageLikelihood image(scores, sweep, sessions, LocalizerConfig());
    TrackerConfig config;
    Dpso swarm(map, config.dpso, 1);
    double sum = 0.0;
    for (int i = 0; i < 100; ++i) {
      const Eigen::Vector2d robot_m = test::onCircle(0.6 * i);
      sessions.startImage(i * 1'000'000'000LL);
      scores.startImage(FeatureKind::kLocal, [&](FeatureKind, std::size_t training) {
        const double bell = std::exp(-0.125 * (map.position_m(training) - robot_m).squaredNorm());
        return test::World::scoreAt((map.pose(training).session == 1 ? 0.5 : 0.1) * bell);
      });
      sweep.startImage();
      const TrackerEstimate estimate = see(swarm, test::Seen{map, scores, image});
      sessions.noteRecognition(estimate.best.recognised);
      const auto trial = sessions.trial(map.position_m(estimate.best_image), map.yaw_rad(estimate.best_image));
      if (trial) {
        sessions.learn(estimate.best_image, estimate.best.weight, *trial, scores[*trial].weight);
      }
      if (i >= 50) sum += static_cast<double>(scores.comparisons());
    }
    if (choose) {
      EXPECT_EQ(sessions.chosen(), 1U);
    }
    return sum / 50.0;
  };
  EXPECT_LT(meanComparisons(true), 0.75 * meanComparisons(false));
}

}  // namespace
}  // namespace visual_localization
