#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "node/image_worker.h"
#include "test/support/stamps.h"

namespace visual_localization {
namespace {

using test::kSecond_ns;

/// One letter per image: . in order, L late, B back.
std::string verdicts(const std::vector<int>& stamps_s) {
  StampMonitor monitor;
  std::string text;
  for (const int stamp_s : stamps_s) {
    const auto verdict = monitor.judge(stamp_s * kSecond_ns);
    text += verdict == StampMonitor::Verdict::kInOrder ? '.' : verdict == StampMonitor::Verdict::kLate ? 'L' : 'B';
  }
  return text;
}

TEST(StampMonitor, ImagesInOrderAndRepeatedOnesAreNotLate) { EXPECT_EQ(verdicts({1, 2, 2, 2, 3, 100}), "......"); }

TEST(StampMonitor, ASingleOlderImageIsLate) {
  EXPECT_EQ(verdicts({1, 2, 4, 3, 5, 6}), "...L..");
  EXPECT_EQ(verdicts({10, 9, 8, 11}), ".LL.");
}

TEST(StampMonitor, ABagThatStartsAgainLosesOneImage) {
  EXPECT_EQ(verdicts({100, 200, 1, 2, 3}), "..LB.");
  EXPECT_EQ(verdicts({100, 200, 1, 2, 100, 200, 1, 2}), "..LB..LB");
}

TEST(StampMonitor, OneImageFromTheFutureDoesNotSilenceTheRest) { EXPECT_EQ(verdicts({1, 2, 4000, 3, 4, 5}), "...LB."); }

TEST(StampMonitor, OfTwoPublishersTheOneWhoseClockIsAheadWins) {
  EXPECT_EQ(verdicts({20, 10, 21, 11, 22, 12}), ".L.L.L");
}

TEST(StampMonitor, TellsHowFar) {
  StampMonitor monitor;
  monitor.judge(10 * kSecond_ns);
  EXPECT_EQ(monitor.lag_s(), 0.0);
  monitor.judge(4 * kSecond_ns);
  EXPECT_DOUBLE_EQ(monitor.lag_s(), 6.0);
}

}  // namespace
}  // namespace visual_localization
