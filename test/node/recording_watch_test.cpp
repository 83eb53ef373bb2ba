#include "node/recording_watch.h"

#include <limits>

#include <gtest/gtest.h>

#include "test/support/stamps.h"
#include "test/support/synthetic.h"

namespace visual_localization {
namespace {

using test::kSecond_ns;

constexpr std::size_t kMany = 300;  ///< features

/// A robot that drives east, with a fix and an image every second.
class RecordingWatchTest : public testing::Test {
 protected:
  static Fix fixAt(double east_m, double second, double sigma_m = 0.5) {
    const LocalFrame frame({48.5, 9.0, 400.0});
    Fix fix;
    fix.stamp_ns = static_cast<std::int64_t>(second * 1e9);
    fix.position = frame.toGeodetic({east_m, 0.0});
    fix.has_fix = true;
    fix.sigma_m = sigma_m;
    return fix;
  }
  void drive(RecordingWatch& watch, double speed_mps, int seconds, std::size_t features = kMany, double sigma_m = 0.5) {
    for (int i = 0; i < seconds; ++i, ++second_) {
      watch.addFix(fixAt(speed_mps * second_, second_, sigma_m));
      watch.addImage(second_ * kSecond_ns);
      watch.addLook(second_ * kSecond_ns, features);
    }
  }
  static std::size_t weak(const RecordingWatch& watch, Weakness weakness) {
    return watch.summary().weak[static_cast<std::size_t>(weakness)];
  }

  int second_ = 0;
  RecordingWatch watch_{{}, nullptr};
};

TEST_F(RecordingWatchTest, FindsNothingWrongWithAGoodSession) {
  drive(watch_, 0.65, 20);
  EXPECT_EQ(weak(watch_, Weakness::kNone), 20U);
  EXPECT_EQ(watch_.spots().size(), 20U);
  EXPECT_NEAR(watch_.summary().way_m, 19 * 0.65, 3.0);
  EXPECT_NEAR(watch_.summary().spacing_m, 0.65, 0.01);
  EXPECT_NEAR(watch_.spots().back().position_m.x(), 19 * 0.65, 0.01);
}

TEST_F(RecordingWatchTest, SaysThatTheRobotIsTooFast) {
  drive(watch_, 3.0, 10);
  EXPECT_EQ(watch_.summary().now, Weakness::kFarApart);
}

TEST_F(RecordingWatchTest, ASlowComputerIsNoFastRobot) {
  for (int i = 0; i < 60; ++i) {  // 0.2 m apart, looked at every tenth
    watch_.addFix(fixAt(0.2 * i, 0.1 * i));
    watch_.addImage(i * kSecond_ns / 10);
    if (i % 10 == 0) watch_.addLook(i * kSecond_ns / 10, kMany);
  }
  EXPECT_EQ(watch_.summary().now, Weakness::kNone);
  EXPECT_NEAR(watch_.summary().spacing_m, 0.2, 0.01);
  EXPECT_EQ(watch_.summary().images, 6U);
}

TEST_F(RecordingWatchTest, SaysThatThereIsLittleToSee) {
  drive(watch_, 0.65, 5);
  drive(watch_, 0.65, 3, 49);
  EXPECT_EQ(watch_.summary().now, Weakness::kFewFeatures);
  EXPECT_EQ(weak(watch_, Weakness::kFewFeatures), 3U);
  drive(watch_, 0.65, 1, 50);
  EXPECT_EQ(watch_.summary().now, Weakness::kNone);
}

TEST_F(RecordingWatchTest, SaysThatTheReceiverDoubts) {
  drive(watch_, 0.65, 5, kMany, 3.5);
  EXPECT_EQ(watch_.summary().now, Weakness::kPoorFix);
}

TEST_F(RecordingWatchTest, AnImageLongAfterTheLastFixHasNoPosition) {
  drive(watch_, 0.65, 5);
  watch_.addLook(7 * kSecond_ns, kMany);
  EXPECT_EQ(watch_.summary().now, Weakness::kNoFix);
  ASSERT_EQ(watch_.spots().size(), 6U);
  EXPECT_EQ(watch_.spots().back().weakness, Weakness::kNoFix);
  EXPECT_EQ(watch_.spots().back().position_m, watch_.spots()[4].position_m);
}

TEST_F(RecordingWatchTest, AReceiverWithoutAFixDoesNotCount) {
  Fix none = fixAt(0.0, 0.0);
  none.has_fix = false;
  watch_.addFix(none);
  watch_.addFix(Fix{0, {0.0, 0.0, 0.0}, true});
  watch_.addLook(0, kMany);
  EXPECT_EQ(watch_.summary().now, Weakness::kNoFix);
  EXPECT_EQ(watch_.summary().fixes, 2U);
  EXPECT_EQ(watch_.summary().usable_fixes, 0U);
  EXPECT_TRUE(watch_.spots().empty());
}

TEST_F(RecordingWatchTest, AReceiverNeedNotKnowItsAltitude) {
  Fix flat = fixAt(0.0, 0.0);
  flat.position.altitude_m = std::numeric_limits<double>::quiet_NaN();
  watch_.addFix(flat);
  watch_.addLook(0, kMany);
  EXPECT_EQ(watch_.summary().now, Weakness::kNone);
  ASSERT_EQ(watch_.spots().size(), 1U);
  EXPECT_TRUE(watch_.spots().front().position_m.allFinite());
}

TEST_F(RecordingWatchTest, NoticesWhatTheMapHasAlready) {
  const auto map = test::mapAt(test::street(30, 0.65));  // at midnight, as the drive
  RecordingWatch same(WatchConfig(), map);
  drive(same, 0.65, 20);
  EXPECT_EQ(same.summary().known_way_share, 1.0);
  RecordingWatch later(WatchConfig(), map);
  second_ = 0;
  for (int i = 0; i < 20; ++i) {
    later.addFix(fixAt(0.65 * i, 3 * 3600 + i));
    later.addLook((3 * 3600 + i) * kSecond_ns, kMany);
  }
  EXPECT_EQ(later.summary().known_way_share, 0.0) << "three hours later the light is another";
}

}  // namespace
}  // namespace visual_localization
