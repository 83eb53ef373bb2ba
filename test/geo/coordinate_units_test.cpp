#include "geo/coordinate_units.h"

#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/numbers.h"

namespace visual_localization {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

/// A drive that begins here, with one position that is none.
std::vector<Fix> driveFrom(double latitude, double longitude, double step, bool has_fix = true) {
  std::vector<Fix> fixes;
  for (int k = 0; k < 100; ++k) fixes.push_back({k, {latitude + k * step, longitude, 200.0}, has_fix});
  fixes[7].position.latitude_deg = std::numeric_limits<double>::quiet_NaN();
  return fixes;
}

void expectAt(const std::vector<Fix>& fixes, double latitude_deg, double longitude_deg) {
  EXPECT_NEAR(fixes.front().position.latitude_deg, latitude_deg, 1e-9);
  EXPECT_NEAR(fixes.front().position.longitude_deg, longitude_deg, 1e-9);
  EXPECT_TRUE(hasPosition(fixes.front()));
}

TEST(CoordinateUnits, LeavesDegreesAlone) {
  for (const auto& [latitude, longitude] : {std::pair(48.5, 9.07), {-33.9, 151.2}, {0.0001, 0.0002}, {5.5, -0.2}}) {
    auto fixes = driveFrom(latitude, longitude, 1e-6);
    EXPECT_THAT(repairUnits(fixes), IsEmpty());
    expectAt(fixes, latitude, longitude);
  }
  std::vector<Fix> none;
  EXPECT_THAT(repairUnits(none), IsEmpty());
}

TEST(CoordinateUnits, TakesLongitudesFromZeroTo360) {
  auto fixes = driveFrom(37.8, 237.6, 1e-6);
  EXPECT_THAT(repairUnits(fixes), ElementsAre(HasSubstr("0 to 360")));
  expectAt(fixes, 37.8, -122.4);
}

TEST(CoordinateUnits, PutsLatitudeAndLongitudeRightWhereOnlyThatIsOnTheEarth) {
  auto fixes = driveFrom(-122.4, 37.8, 1e-6);
  EXPECT_THAT(repairUnits(fixes), ElementsAre(HasSubstr("exchanged")));
  expectAt(fixes, 37.8, -122.4);
}

TEST(CoordinateUnits, TakesTenMillionthsOfADegree) {
  auto fixes = driveFrom(485345000.0, 90713000.0, 10.0);
  EXPECT_THAT(repairUnits(fixes), ElementsAre(HasSubstr("1e-7 degrees")));
  expectAt(fixes, 48.5345, 9.0713);
}

TEST(CoordinateUnits, TakesRadians) {
  auto fixes = driveFrom(toRadians(48.5), toRadians(9.07), 1e-8);
  EXPECT_THAT(repairUnits(fixes), ElementsAre(HasSubstr("radians")));
  expectAt(fixes, 48.5, 9.07);
}

TEST(CoordinateUnits, DoesNotBelieveAStatusThatIsNeverSet) {
  auto fixes = driveFrom(48.5, 9.07, 1e-6, false);
  EXPECT_THAT(repairUnits(fixes), ElementsAre(HasSubstr("status")));
  expectAt(fixes, 48.5, 9.07);
  EXPECT_FALSE(hasPosition(fixes[7]));
  fixes = driveFrom(48.5, 9.07, 1e-6, false);
  fixes.back().has_fix = true;
  EXPECT_THAT(repairUnits(fixes), IsEmpty()) << "then it means something";
  EXPECT_FALSE(hasPosition(fixes.front()));
}

TEST(CoordinateUnits, LeavesWhatIsNowhereOnTheEarth) {
  auto fixes = driveFrom(1e12, 400.0, 1.0);
  EXPECT_THAT(repairUnits(fixes), IsEmpty());
  EXPECT_FALSE(hasPosition(fixes.front()));
}

}  // namespace
}  // namespace visual_localization
