#include <gtest/gtest.h>

#include "geometry/session_geometry.h"
#include "test/geometry/recorded_street.h"

namespace visual_localization {
namespace {

std::optional<CameraModel> calibrated(const test::StreetDrive& street, double focal_px, std::uint32_t seed) {
  const CameraModel camera({{640, 480}, focal_px, focal_px, 319.5, 239.5, Distortion::kPlumbBob, {}});
  const test::RecordedDrive drive = test::recorded(street, seed, camera);
  UnadjustedSession session = drive.unadjusted();
  session.camera = nullptr;
  return calibrateByImages(session, camera.size(), {}, 1);
}

TEST(SelfCalibration, FindsTheFocalLengthToAHundredth) {
  std::uint32_t seed = 31;
  for (const double focal_px : {350.0, 450.0, 700.0}) {
    const auto camera = calibrated({}, focal_px, seed++);
    ASSERT_TRUE(camera) << focal_px;
    EXPECT_NEAR(camera->intrinsics().fx, focal_px, 0.01 * focal_px);
    EXPECT_EQ(camera->intrinsics().fy, camera->intrinsics().fx);
    EXPECT_EQ(camera->intrinsics().cx, 319.5);
    EXPECT_EQ(camera->intrinsics().cy, 239.5);
    EXPECT_TRUE(camera->isPinhole());
  }
}

/// Straight on, a lens twice as long shows the same of a world twice as deep.
TEST(SelfCalibration, SaysNothingOnAStraightStreet) {
  test::StreetDrive street;
  street.turn_rad = 0.0;
  EXPECT_FALSE(calibrated(street, 450.0, 41));
}

TEST(SelfCalibration, SaysNothingOfImagesWithoutFeatures) {
  test::RecordedDrive drive = test::recorded({}, 51);
  for (auto& view : drive.views) view = std::make_shared<const LocalFeatures>();
  EXPECT_FALSE(calibrateByImages(drive.unadjusted(), drive.camera.size(), {}, 1));
}

}  // namespace
}  // namespace visual_localization
