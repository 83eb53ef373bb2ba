#include "geometry/heading_offset.h"

#include <cmath>
#include <cstddef>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "base/numbers.h"

namespace visual_localization {
namespace {

constexpr double kOffset_rad = 0.006;
constexpr double kAhead_m = 1.6;  ///< of the axle

/// More bends to the left than to the right, as of a drive round a block. `correlation`: of the noise of neighbours.
std::vector<DrivenHeading> driven(std::size_t count, double noise_rad, double correlation, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal(0.0, noise_rad);
  std::vector<DrivenHeading> headings;
  double noise = normal(random);
  for (std::size_t i = 0; i < count; ++i) {
    noise = correlation * noise + std::sqrt(1.0 - correlation * correlation) * normal(random);
    const double curvature_1_m = i % 40 < 15 ? 0.08 : (i % 40 > 30 ? -0.04 : 0.0);
    headings.push_back({kOffset_rad - kAhead_m * curvature_1_m + noise, curvature_1_m});
  }
  return headings;
}

TEST(HeadingOffset, IsToldFromTheSwingOfACameraAheadOfTheAxle) {
  const HeadingOffset offset = headingOffset(driven(200, 0.004, 0.0, 1));
  EXPECT_NEAR(offset.yaw_rad, kOffset_rad, 0.001);
  EXPECT_LT(offset.sigma_rad, 0.001);
}

TEST(HeadingOffset, IsNotMovedByAFewHeadingsThatAreFarOff) {
  std::vector<DrivenHeading> headings = driven(200, 0.004, 0.0, 2);
  for (std::size_t i = 0; i < headings.size(); i += 9) headings[i].beside_rad += 0.5;
  EXPECT_NEAR(headingOffset(headings).yaw_rad, kOffset_rad, 0.002);
}

TEST(HeadingOffset, KnowsItsSigmaWhereHeadingsErrAlike) {
  constexpr unsigned kDrives = 200;
  unsigned within_two = 0;
  for (unsigned seed = 0; seed < kDrives; ++seed) {
    const HeadingOffset offset = headingOffset(driven(240, 0.05, 0.8, seed));
    if (std::abs(offset.yaw_rad - kOffset_rad) < 2.0 * offset.sigma_rad) ++within_two;
  }
  EXPECT_GT(within_two, kDrives * 85 / 100) << "95 % of normal errors";
}

TEST(HeadingOffset, IsNotKnownByFewHeadings) {
  EXPECT_TRUE(std::isinf(headingOffset({}).sigma_rad));
  EXPECT_TRUE(std::isinf(headingOffset(driven(35, 0.004, 0.0, 3)).sigma_rad));
}

TEST(HeadingOffset, NeedsNoBends) {
  std::vector<DrivenHeading> headings(60, {kOffset_rad, 0.0});
  EXPECT_NEAR(headingOffset(headings).yaw_rad, kOffset_rad, 1e-6);
}

}  // namespace
}  // namespace visual_localization
