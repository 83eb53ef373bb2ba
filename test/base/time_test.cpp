#include "base/time.h"

#include <limits>

#include <gtest/gtest.h>

namespace visual_localization {
namespace {

constexpr std::int64_t kHour_ns = 3'600'000'000'000;

TEST(ApartInDay, CountsTheShorterWayRoundTheClock) {
  EXPECT_EQ(apartInDay_ns(8 * kHour_ns, 11 * kHour_ns), 3 * kHour_ns);
  EXPECT_EQ(apartInDay_ns(23 * kHour_ns, (24 * 1000 + 1) * kHour_ns), 2 * kHour_ns);
  EXPECT_EQ(apartInDay_ns(6 * kHour_ns, 18 * kHour_ns), 12 * kHour_ns);
}

TEST(ApartInDay, IsWithinHalfADayForAnyStamps) {
  for (const std::int64_t a :
       {std::numeric_limits<std::int64_t>::min(), std::int64_t{-30} * kHour_ns, std::int64_t{0}}) {
    for (const std::int64_t b : {std::int64_t{5} * kHour_ns, std::numeric_limits<std::int64_t>::max()}) {
      EXPECT_GE(apartInDay_ns(a, b), 0);
      EXPECT_LE(apartInDay_ns(a, b), 12 * kHour_ns);
      EXPECT_EQ(apartInDay_ns(a, b), apartInDay_ns(b, a));
    }
  }
}

}  // namespace
}  // namespace visual_localization
