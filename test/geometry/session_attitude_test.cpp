// Cameras that are mounted in any attitude, and robots that reverse.

#include <cmath>
#include <optional>

#include <gtest/gtest.h>

#include "base/numbers.h"
#include "geometry/relative_rotation.h"
#include "test/geometry/recorded_street.h"

namespace visual_localization {
namespace {

using test::imagesIn;
using test::kPathError_m;
using test::pathError_m;
using test::recorded;
using test::RecordedDrive;

constexpr double kTimes = 1.3;  ///< the error of the camera that looks ahead

SessionGeometry mounted(const test::StreetDrive& street, const RecordedDrive& drive) {
  UnadjustedSession session = drive.unadjusted();
  session.mount.camera.rotation = levelCamera(0.0) * test::mountingOf(street);
  return adjustSessions({session}, {}, 1).front();
}

/// The camera turned by `attitude_deg`: yaw, pitch and roll.
test::StreetDrive streetWith(const Eigen::Vector3d& attitude_deg) {
  test::StreetDrive street;
  street.yaw_rad = toRadians(attitude_deg.x());
  street.pitch_rad = toRadians(attitude_deg.y());
  street.roll_rad = toRadians(attitude_deg.z());
  return street;
}

class SessionAttitude : public testing::TestWithParam<Eigen::Vector3d> {};  // yaw, pitch, roll, degrees

TEST_P(SessionAttitude, StartsFromTheMounting) {
  const test::StreetDrive street = streetWith(GetParam());
  const RecordedDrive drive = recorded(street, 61);
  const SessionGeometry geometry = mounted(street, drive);
  EXPECT_GT(imagesIn(geometry), drive.truth.size() * 2 / 3) << "who looks aside or back sees no things at first";
  EXPECT_LT(pathError_m(geometry, drive.truth), kTimes * kPathError_m);
  const Eigen::AngleAxisd found(geometry.mounting_rad.norm(), geometry.mounting_rad.normalized());
  EXPECT_LT(Eigen::Quaterniond(found).angularDistance(test::mountingOf(street)), toRadians(2.0));
}

INSTANTIATE_TEST_SUITE_P(Mountings, SessionAttitude,
                         testing::Values(Eigen::Vector3d(0.0, 0.0, 20.0), Eigen::Vector3d(0.0, 0.0, 90.0),
                                         Eigen::Vector3d(0.0, 0.0, 180.0), Eigen::Vector3d(90.0, 0.0, 0.0),
                                         Eigen::Vector3d(180.0, 0.0, 0.0), Eigen::Vector3d(0.0, 10.0, 0.0),
                                         Eigen::Vector3d(-45.0, -10.0, 90.0)));

class UnknownMounting : public testing::TestWithParam<Eigen::Vector3d> {};

TEST_P(UnknownMounting, IsFoundByTheImages) {
  const test::StreetDrive street = streetWith(GetParam());
  const RecordedDrive drive = recorded(street, 61);
  UnadjustedSession session = drive.unadjusted();
  session.finds_mount = true;
  const SessionGeometry geometry = adjustSessions({session}, {}, 1).front();
  EXPECT_GT(imagesIn(geometry), drive.truth.size() * 2 / 3);
  EXPECT_LT(pathError_m(geometry, drive.truth), kTimes * kPathError_m);
  ASSERT_TRUE(geometry.found_camera);
  const Eigen::Quaterniond truth = levelCamera(0.0) * test::mountingOf(street);
  EXPECT_LT(geometry.found_camera->rotation.angularDistance(truth), toRadians(2.0));
  if (std::remainder(GetParam().x(), 90.0) != 0.0) return;
  const CameraPose looks{truth, {0.0, 0.0, 0.0}};
  EXPECT_NEAR(std::remainder(geometry.found_camera->yaw_rad() - looks.yaw_rad(), 2.0 * kPi), 0.0, 1e-6)
      << "nothing significant against ahead, aside or back";
}

INSTANTIATE_TEST_SUITE_P(Mountings, UnknownMounting,
                         testing::Values(Eigen::Vector3d(0.0, 0.0, 20.0), Eigen::Vector3d(0.0, 0.0, 90.0),
                                         Eigen::Vector3d(0.0, 0.0, 180.0), Eigen::Vector3d(90.0, 0.0, 0.0),
                                         Eigen::Vector3d(180.0, 0.0, 0.0), Eigen::Vector3d(-45.0, -10.0, 90.0)));

TEST(UnknownMountingOfALevelCamera, IsTurnedAsFarAsTheDriveSaysSignificantly) {
  const RecordedDrive drive = recorded(streetWith({5.0, 0.0, 0.0}), 61);
  UnadjustedSession session = drive.unadjusted();
  session.finds_mount = true;
  const std::optional<CameraPose> camera = adjustSessions({session}, {}, 1).front().found_camera;
  ASSERT_TRUE(camera);
  EXPECT_LT(camera->rotation.angularDistance(levelCamera(toRadians(-5.0))), toRadians(1.0));
  EXPECT_NEAR(camera->ahead().z(), 0.0, 1e-9) << "the drive says nothing about its pitch";
}

TEST(UnknownMountingOfALevelCamera, IsLeftToTheAdjustment) {
  const RecordedDrive drive = recorded({}, 61);
  UnadjustedSession session = drive.unadjusted();
  session.finds_mount = true;
  const SessionGeometry geometry = adjustSessions({session}, {}, 1).front();
  EXPECT_FALSE(geometry.found_camera);
  EXPECT_LT(pathError_m(geometry, drive.truth), kPathError_m);
}

TEST(SessionAttitude, LooksWhereItLookedWhileTheRobotReverses) {
  test::StreetDrive street;
  street.reverses = true;
  const RecordedDrive drive = recorded(street, 62);
  const SessionGeometry geometry = mounted(street, drive);
  EXPECT_GT(imagesIn(geometry), drive.truth.size() * 9 / 10);
  EXPECT_LT(pathError_m(geometry, drive.truth), kTimes * kPathError_m);
  for (std::size_t i = 0; i < drive.truth.size(); ++i) {
    if (!geometry.images[i]) continue;
    EXPECT_LT(geometry.images[i]->camera.rotation.angularDistance(drive.truth[i].camera.rotation), 0.1) << i;
  }
}

TEST(DrivingDirections, TurnAboutWhereTheCourseDoesAndTheImagesDoNot) {
  std::vector<double> courses_rad(10, 0.3);
  for (std::size_t i = 6; i < 9; ++i) courses_rad[i] = 0.3 - kPi;
  std::vector<RelativeRotation> relative;
  for (std::uint32_t i = 1; i < 10; ++i) relative.push_back({i - 1, i, Eigen::Quaterniond::Identity()});
  const std::vector<double> directions = drivingDirections(courses_rad, relative);
  for (std::size_t i = 0; i < 10; ++i) EXPECT_EQ(directions[i], i >= 6 && i < 9 ? -1.0 : 1.0) << i;
  EXPECT_EQ(drivingDirections(courses_rad, {}), std::vector<double>(10, 1.0)) << "a robot may turn about";
}

}  // namespace
}  // namespace visual_localization
