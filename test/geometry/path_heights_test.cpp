#include <cmath>
#include <limits>
#include <random>

#include <gtest/gtest.h>

#include "base/numbers.h"
#include "geometry/reconstruction.h"
#include "test/support/stamps.h"

namespace visual_localization {
namespace {

using test::kSecond_ns;

constexpr std::size_t kImages = 100;

/// A hill of 3 m, 100 m along: up at first, then down.
double hill_m(double along_m) { return 3.0 * std::sin(kPi * along_m / 100.0); }

/// To the east at 1 m/s.
std::vector<TrajectoryPoint> images() {
  std::vector<TrajectoryPoint> path(kImages);
  for (std::size_t i = 0; i < kImages; ++i) {
    path[i].stamp_ns = static_cast<std::int64_t>(i) * kSecond_ns;
    path[i].position_m = {static_cast<double>(i), 0.0};
  }
  return path;
}

/// Five a second, with altitudes 400 m up.
std::vector<MapFix> fixes(double noise_m) {
  std::mt19937 random(1);
  std::normal_distribution<double> noise(0.0, 1.0);
  std::vector<MapFix> fixes;
  for (int k = 0; k < 5 * static_cast<int>(kImages - 1); ++k) {
    const double along_m = 0.2 * k;
    fixes.push_back({k * kSecond_ns / 5, {along_m, 0.1}, 0.3, 400.0 + hill_m(along_m) + noise_m * noise(random), 0.6});
  }
  return fixes;
}

TEST(PathHeights, FollowTheAltitudesOfTheFixes) {
  const PathHeights heights = pathHeights(images(), fixes(0.3));
  ASSERT_TRUE(heights.measured);
  ASSERT_EQ(heights.up_m.size(), kImages);
  EXPECT_EQ(heights.up_m.front(), 0.0);
  EXPECT_DOUBLE_EQ(heights.sigma_m, 0.6);
  for (std::size_t i = 0; i < kImages; ++i) {
    const auto along_m = static_cast<double>(i);
    EXPECT_NEAR(heights.up_m[i], hill_m(along_m), 0.35) << i;  // a line of 40 m cuts the top off
    EXPECT_NEAR(heights.slope[i], 0.03 * kPi * std::cos(kPi * along_m / 100.0), 0.02) << i;
  }
}

TEST(PathHeights, FixesFarFromThePathSayNothing) {
  auto all = fixes(0.0);
  const PathHeights right = pathHeights(images(), all);
  for (std::size_t k = 0; k < all.size(); k += 3) {
    all[k].position_m.y() = 8.0;  // multipath
    all[k].up_m += 30.0;
  }
  const PathHeights found = pathHeights(images(), all);
  ASSERT_EQ(found.up_m.size(), kImages);
  for (std::size_t i = 0; i < kImages; ++i) EXPECT_NEAR(found.up_m[i], right.up_m[i], 0.05) << i;
}

void expectLevel(const PathHeights& heights, std::size_t images) {
  EXPECT_FALSE(heights.measured);
  EXPECT_EQ(heights.up_m, std::vector<double>(images));
  EXPECT_EQ(heights.slope, std::vector<double>(images));
}

TEST(PathHeights, AreLevelWithoutMeasuredAltitudes) {
  expectLevel(pathHeights({}, {}), 0);
  expectLevel(pathHeights(images(), {}), kImages);
  auto unknown = fixes(0.3);
  for (MapFix& fix : unknown) fix.up_m = std::numeric_limits<double>::quiet_NaN();
  expectLevel(pathHeights(images(), unknown), kImages);
  auto constant = fixes(0.3);
  for (MapFix& fix : constant) fix.up_m = 445.0;
  expectLevel(pathHeights(images(), constant), kImages);  // the receiver measures none
  auto half = fixes(0.3);
  half.resize(half.size() / 3);
  expectLevel(pathHeights(images(), half), kImages);  // there are images that no fix is near
}

}  // namespace
}  // namespace visual_localization
