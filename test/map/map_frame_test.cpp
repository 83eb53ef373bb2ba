// Where a map begins, and how high: no single fix decides.

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "map/map_geometry.h"
#include "test/geo/recorded_round.h"

namespace visual_localization {
namespace {

/// At 300 m above the ellipsoid.
std::vector<Fix> levelRound() {
  std::vector<Fix> fixes = test::record(test::block, 120.0);
  for (Fix& fix : fixes) fix.position.altitude_m = 300.0;
  return fixes;
}

TEST(MapFrame, TheDatumIsAtTheMiddleOfTheAltitudes) {
  std::vector<Fix> fixes = levelRound();
  fixes[0].position.altitude_m *= 1000.0;
  fixes[1].position.altitude_m = 445e3;
  fixes[2].position.altitude_m = 350.0;
  fixes[3].position.altitude_m = std::nan("");
  const LocalFrame frame = frameFor(fixes, {});
  EXPECT_DOUBLE_EQ(frame.datum().altitude_m, 300.0);
  EXPECT_NEAR(frame.datum().latitude_deg, test::kDatum.latitude_deg, 1e-5);
}

TEST(MapFrame, WithoutAltitudesItLiesOnTheEllipsoid) {
  std::vector<Fix> fixes = levelRound();
  for (Fix& fix : fixes) fix.position.altitude_m = std::nan("");
  EXPECT_EQ(frameFor(fixes, {}).datum().altitude_m, 0.0);
}

TEST(MapFrame, AnAbsurdAltitudeIsNoneAndTheFixStays) {
  std::vector<Fix> fixes = levelRound();
  fixes[200].position.altitude_m *= 1000.0;
  const LocalFrame frame = frameFor(fixes, {});
  const std::vector<MapFix> found = inFrame(fixes, std::vector<FixVerdict>(fixes.size(), FixVerdict::kKept), frame);
  ASSERT_EQ(found.size(), fixes.size());
  for (std::size_t i = 0; i < found.size(); ++i) {
    EXPECT_EQ(std::isfinite(found[i].up_m), i != 200) << i;
    if (i != 200) {
      EXPECT_NEAR(found[i].up_m, 0.0, 1e-9) << i;
    }
  }
}

TEST(MapFrame, AltitudesOfTheSeaAndOfTheEllipsoidAreBroughtTogether) {
  std::vector<Fix> fixes = levelRound();
  for (std::size_t i = 300; i < fixes.size(); ++i) fixes[i].position.altitude_m += 47.0;
  const std::vector<MapFix> found =
      inFrame(fixes, std::vector<FixVerdict>(fixes.size(), FixVerdict::kKept), frameFor(fixes, {}));
  for (const MapFix& fix : found) EXPECT_NEAR(fix.up_m, found.front().up_m, 1.0);
}

TEST(MapFrame, AFixThatIsOnlyRepeatedSaysNothingOfItsTime) {
  const std::vector<Fix> fixes = levelRound();
  std::vector<FixVerdict> verdicts(fixes.size(), FixVerdict::kKept);
  verdicts[1] = FixVerdict::kRepeated;
  verdicts[3] = FixVerdict::kMultipath;
  const std::vector<MapFix> found = inFrame(fixes, verdicts, frameFor(fixes, {}));
  ASSERT_EQ(found.size(), fixes.size() - 1);
  EXPECT_EQ(found[1].stamp_ns, fixes[2].stamp_ns);
  EXPECT_FALSE(found[2].believed) << "the images decide about multipath";
}

}  // namespace
}  // namespace visual_localization
