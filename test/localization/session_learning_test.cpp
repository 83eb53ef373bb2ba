// How much better than the chosen session another one must match, and sessions that were never here.

#include <memory>
#include <vector>

#include <gtest/gtest.h>

#include "localization/session_choice.h"

namespace visual_localization {
namespace {

constexpr std::size_t kOfFirst = 3;    ///< a training image of the first session
constexpr std::size_t kOfSecond = 13;  ///< of the second one, at the same position

/// A street along x that two sessions drove and a third one did not.
std::shared_ptr<const TrainingMap> drivenTwice() {
  MapHeader header;
  header.image_size = {320, 240};
  header.sessions = {{"first"}, {"second"}, {"elsewhere"}};
  std::vector<TrainingImage> images;
  for (int session = 0; session < 2; ++session) {
    for (int i = 0; i < 10; ++i) {
      TrainingImage image;
      image.stamp_ns = (100 * session + i) * 1'000'000'000LL;
      image.session = session;
      image.position_m = {2.0 * i, 0.1 * session};
      images.push_back(image);
    }
  }
  return std::make_shared<const TrainingMap>(header, images);
}

class SessionLearning : public testing::Test {
 protected:
  SessionLearning() { sessions_.startImage(0); }

  /// An image matches the chosen session as well as `match` says and another one `ratio` times as well.
  void learn(std::size_t chosen, std::size_t other, double ratio, double match = 0.1) {
    constexpr double kLeast = 0.01;  // is added to both
    sessions_.learn(chosen, match, other, ratio * (match + kLeast) - kLeast);
  }

  std::shared_ptr<const TrainingMap> map_ = drivenTwice();
  SessionChoice sessions_{*map_, true};
};

// What is known of the second one is 0.7 + 0.3 * 4 = 1.9 then. The first one must come to 2.09: as good as the second
// one it comes to 1.9 at most.
TEST_F(SessionLearning, TheOneBeforeMustBeATenthBetterThanTheChosenOne) {
  learn(kOfFirst, kOfSecond, 4.0);
  ASSERT_EQ(sessions_.chosen(), 1U);
  for (int i = 0; i < 30; ++i) learn(kOfSecond, kOfFirst, 1.0);
  EXPECT_EQ(sessions_.chosen(), 1U);
  for (int i = 0; i < 30; ++i) learn(kOfSecond, kOfFirst, 1.08);
  EXPECT_EQ(sessions_.chosen(), 1U);
  for (int i = 0; i < 30; ++i) learn(kOfSecond, kOfFirst, 1.12);
  EXPECT_EQ(sessions_.chosen(), 0U);
}

TEST_F(SessionLearning, OneImageCountsTenTimesAtMost) {
  learn(kOfFirst, kOfSecond, 500.0);  // 0.7 + 0.3 * 10 = 3.7
  ASSERT_EQ(sessions_.chosen(), 1U);
  learn(kOfSecond, kOfFirst, 3.2);  // 0.7 + 0.3 * 3.2 * 3.7 = 4.25, more than 4.07
  EXPECT_EQ(sessions_.chosen(), 0U);
}

TEST_F(SessionLearning, ASessionSaysNothingAboutItself) {
  for (int i = 0; i < 10; ++i) learn(kOfFirst, kOfFirst + 1, 4.0);
  for (int i = 0; i < 3; ++i) learn(kOfFirst, kOfSecond, 1.2);
  EXPECT_EQ(sessions_.chosen(), 1U);
}

TEST_F(SessionLearning, LearnsNothingWhileItIsOff) {
  sessions_.configure(false);
  for (int i = 0; i < 10; ++i) learn(kOfFirst, kOfSecond, 4.0);
  sessions_.configure(true);
  EXPECT_EQ(sessions_.chosen(), 0U);
}

TEST_F(SessionLearning, ASessionThatWasNeverHereStandsForNothing) {
  for (int i = 0; i < 10 && sessions_.chosen() != 2U; ++i) sessions_.noteRecognition(false);
  ASSERT_EQ(sessions_.chosen(), 2U) << "tried in its turn";
  for (const double x_m : {0.4, 7.0, 30.0}) {
    EXPECT_EQ(sessions_.nearest({x_m, 0.0}).image, map_->nearest({x_m, 0.0}).image);
    EXPECT_EQ(sessions_.around({x_m, 0.0}, 0.0, 3), sessions_.aroundAny({x_m, 0.0}, 0.0, 3));
  }
}

}  // namespace
}  // namespace visual_localization
