#include "geo/altitudes.h"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

namespace visual_localization {
namespace {

/// Uphill at 5 %, a sample each 2 m, with noise of half a metre.
std::vector<AltitudeSample> hill(std::size_t count) {
  std::vector<AltitudeSample> samples;
  for (std::size_t i = 0; i < count; ++i) {
    const double along_m = 2.0 * static_cast<double>(i);
    samples.push_back({{along_m, 0.0}, 300.0 + 0.05 * along_m + (i % 3 == 0 ? 0.5 : -0.25)});
  }
  return samples;
}

TEST(PlausibleAltitude, IsWhereRobotsDrive) {
  EXPECT_EQ(plausibleAltitude(-430.0), -430.0) << "at the Dead Sea";
  EXPECT_FALSE(plausibleAltitude(445000.0));
  EXPECT_FALSE(plausibleAltitude(-1e5));
  EXPECT_FALSE(plausibleAltitude(std::nan("")));
}

TEST(SteadyAltitudes, OfAHillAreItsOwn) {
  const std::vector<AltitudeSample> samples = hill(100);
  const std::vector<double> steady_m = steadyAltitudes(samples);
  for (std::size_t i = 0; i < samples.size(); ++i) EXPECT_EQ(steady_m[i], samples[i].up_m) << i;
}

TEST(SteadyAltitudes, LeaveOutliersOut) {
  for (const std::size_t first : {0U, 50U, 97U}) {
    std::vector<AltitudeSample> samples = hill(100);
    for (std::size_t i = first; i < first + 3; ++i) samples[i].up_m *= 20.0;
    const std::vector<double> steady_m = steadyAltitudes(samples);
    for (std::size_t i = 0; i < samples.size(); ++i) {
      EXPECT_EQ(std::isfinite(steady_m[i]), i < first || i >= first + 3) << first << ": " << i;
    }
  }
}

TEST(SteadyAltitudes, AreMeasuredFromOneReference) {
  const std::vector<AltitudeSample> samples = hill(120);
  std::vector<AltitudeSample> stepped = samples;
  for (std::size_t i = 40; i < 80; ++i) stepped[i].up_m += 47.3;  // the ellipsoid instead of the sea
  const std::vector<double> steady_m = steadyAltitudes(stepped);
  for (std::size_t i = 0; i < samples.size(); ++i) EXPECT_NEAR(steady_m[i], samples[i].up_m, 2.0) << i;
}

TEST(SteadyAltitudes, AClimbWithoutFixesIsAClimb) {
  std::vector<AltitudeSample> samples = hill(100);
  for (std::size_t i = 50; i < 100; ++i) {
    samples[i].position_m.x() += 200.0;
    samples[i].up_m += 20.0;
  }
  EXPECT_EQ(steadyAltitudes(samples)[80], samples[80].up_m);
}

TEST(SteadyAltitudes, OfNoneOrOne) {
  EXPECT_TRUE(steadyAltitudes({}).empty());
  EXPECT_EQ(steadyAltitudes({{{0.0, 0.0}, 12.0}}), std::vector<double>{12.0});
  EXPECT_TRUE(std::isnan(steadyAltitudes({{{0.0, 0.0}, std::nan("")}}).front()));
}

}  // namespace
}  // namespace visual_localization
