#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/numbers.h"
#include "test/support/refusal.h"
#include "visual_localization/geometry/camera_pose.h"

namespace visual_localization {
namespace {

/// A metre ahead and half a metre to the left, looking 15 degrees to the left.
SensorMount aside() {
  SensorMount mount;
  mount.camera = parseCameraMount("1.0 0.5 1.2 0.2617993877991494 0 0");
  return mount;
}

TEST(SensorMount, IsWhereTheCameraIsUnlessSaid) {
  const CameraPose camera{levelCamera(0.7), {3.0, 4.0, 1.0}};
  const Eigen::Isometry3d base = SensorMount().baseInMap(camera);
  EXPECT_LT((base.translation() - camera.position_m).norm(), 1e-12);
  EXPECT_NEAR(yawOf(base), 0.7, 1e-12);
  EXPECT_LT((base.linear().col(2) - Eigen::Vector3d::UnitZ()).norm(), 1e-12) << "upright";
}

TEST(SensorMount, TakesTheRobotFromItsCamera) {
  // The robot at (10, 20) looks north: the camera is a metre north and half a metre west of it.
  const CameraPose camera{levelCamera(toRadians(90.0 + 15.0)), {9.5, 21.0, 1.2}};
  const Eigen::Isometry3d base = aside().baseInMap(camera);
  EXPECT_LT((base.translation() - Eigen::Vector3d(10.0, 20.0, 0.0)).norm(), 1e-9);
  EXPECT_NEAR(yawOf(base), toRadians(90.0), 1e-9);
}

TEST(SensorMount, KnowsTheAntennaFromTheCamera) {
  SensorMount mount;
  mount.antenna_m = {-0.5, 0.3, 0.4};  // behind, left, above: in the optical frame x right, y down, z ahead
  EXPECT_LT((mount.antennaInCamera_m() - Eigen::Vector3d(-0.3, -0.4, -0.5)).norm(), 1e-12);
}

TEST(SensorMount, ReadsPitchAsTransformPublishersDo) {
  EXPECT_LT(parseCameraMount("0 0 1 0 0.2 0").ahead().z(), 0.0) << "positive pitch looks down";
}

TEST(SensorMount, RefusesWhatIsNoMount) {
  for (const char* text :
       {"", "1 2 3", "1 2 3 4 5", "1 2 3 4 5 6 7", "a b c d e f", "nan 0 0 0 0 0", "200 0 0 0 0 0"}) {
    EXPECT_NE(test::refusalOf<MountError>([text] { parseCameraMount(text); }), "accepted") << text;
  }
  for (const char* text : {"", "1 2", "1 2 3 4", "1 2 x", "0 0 101"}) {
    EXPECT_NE(test::refusalOf<MountError>([text] { parseAntennaMount(text); }), "accepted") << text;
  }
  SensorMount mount;
  mount.camera.rotation.coeffs() *= 2.0;
  EXPECT_THAT(test::refusalOf<MountError>([&mount] { requireMount(mount); }), testing::HasSubstr("unit length"));
  mount = {};
  mount.antenna_m.x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(test::refusalOf<MountError>([&mount] { requireMount(mount); }), testing::HasSubstr("antenna"));
}

TEST(SensorMount, IsDescribedInWords) {
  EXPECT_THAT(describe(aside()), testing::HasSubstr("looking 15.0 degrees to the left"));
}

}  // namespace
}  // namespace visual_localization
