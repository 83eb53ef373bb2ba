#include "node/throttle.h"

#include <gtest/gtest.h>

namespace visual_localization {
namespace {

TEST(Throttle, LetsTheFirstThroughAndThenOnePerPeriod) {
  Throttle throttle(std::chrono::hours(1));
  EXPECT_TRUE(throttle.ready());
  EXPECT_FALSE(throttle.ready());
  Throttle never_quiet(std::chrono::milliseconds(0));
  EXPECT_TRUE(never_quiet.ready());
  EXPECT_TRUE(never_quiet.ready());
}

TEST(Throttle, TwoDoNotSilenceEachOther) {
  Throttle left(std::chrono::hours(1));
  Throttle right(std::chrono::hours(1));
  EXPECT_TRUE(left.ready());
  EXPECT_TRUE(right.ready());
}

}  // namespace
}  // namespace visual_localization
