#include <gtest/gtest.h>

#include "node/localizer_diagnostics.h"

namespace visual_localization {
namespace {

using std::chrono::milliseconds;

/// A moment after the last event.
double rateOf(milliseconds interval, int count) {
  RateMeter meter;
  RateMeter::Clock::time_point now;
  for (int i = 0; i < count; ++i) meter.add(now += interval);
  return meter.rate_hz(now + milliseconds(1));
}

TEST(RateMeter, MeasuresSlowAndFastOnes) {
  EXPECT_NEAR(rateOf(milliseconds(2000), 10), 0.5, 1e-9);
  EXPECT_NEAR(rateOf(milliseconds(100), 10), 10.0, 1e-9);
  EXPECT_NEAR(rateOf(milliseconds(20), 5000), 50.0, 1e-9);
}

TEST(RateMeter, ForgetsWhatIsOver) {
  RateMeter meter;
  const RateMeter::Clock::time_point start;
  EXPECT_EQ(meter.rate_hz(start), 0.0);
  meter.add(start);
  EXPECT_EQ(meter.rate_hz(start), 0.0);
  meter.add(start + milliseconds(500));
  EXPECT_NEAR(meter.rate_hz(start + milliseconds(600)), 2.0, 1e-9);
  EXPECT_EQ(meter.rate_hz(start + milliseconds(20000)), 0.0);
}

}  // namespace
}  // namespace visual_localization
