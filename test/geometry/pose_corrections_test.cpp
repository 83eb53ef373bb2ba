#include "geometry/pose_corrections.h"

#include <gtest/gtest.h>

namespace visual_localization {
namespace {

using TiedPairs = std::vector<std::pair<std::size_t, std::size_t>>;

/// A straight drive to the east, a camera every two metres.
std::vector<CameraPose> straightDrive(std::size_t count) {
  std::vector<CameraPose> cameras;
  for (std::size_t i = 0; i < count; ++i) {
    cameras.push_back({levelCamera(0.0), {2.0 * static_cast<double>(i), 0.0, 1.0}});
  }
  return cameras;
}

TiedPairs oneAfterTheOther(std::size_t count) {
  TiedPairs pairs;
  for (std::size_t i = 1; i < count; ++i) pairs.emplace_back(i - 1, i);
  return pairs;
}

PoseTie tie(std::size_t camera, const CameraPose& at, const Eigen::Vector3d& off_m, double sigma_m = 0.02) {
  PoseTie tie{camera, at, Eigen::Matrix<double, 6, 6>::Identity() * sigma_m * sigma_m};
  tie.pose.position_m += off_m;
  tie.covariance.bottomRightCorner<3, 3>() *= 0.01;
  return tie;
}

TEST(PoseCorrections, NoTiesMoveNothing) {
  const auto cameras = straightDrive(5);
  for (const PoseCorrection& correction : correctionsBy({}, cameras, oneAfterTheOther(5))) {
    EXPECT_TRUE(correction.shift_m.isZero());
    EXPECT_TRUE(correction.turn.isApprox(Eigen::Quaterniond::Identity()));
  }
}

TEST(PoseCorrections, FollowTheTiesAndFadeBeyondThem) {
  const auto cameras = straightDrive(300);
  std::vector<PoseTie> ties;
  for (std::size_t i = 0; i < 50; ++i) ties.push_back(tie(i, cameras[i], {0.4, -0.3, 0.0}));
  const auto corrections = correctionsBy(ties, cameras, oneAfterTheOther(cameras.size()));
  for (std::size_t i = 0; i < 50; ++i)
    EXPECT_NEAR((corrections[i].shift_m.head<2>() - Eigen::Vector2d(0.4, -0.3)).norm(), 0.0, 0.03);
  // Half a minute on foot later half of it is left, and in the end each session lies where its own fixes have it.
  EXPECT_NEAR(corrections[49 + 17].shift_m.x(), 0.2, 0.08);
  EXPECT_NEAR(corrections.back().shift_m.norm(), 0.0, 0.01);
}

TEST(PoseCorrections, TurnsBendThePath) {
  const auto cameras = straightDrive(100);
  const double turn_rad = 0.02;
  std::vector<PoseTie> ties;
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    const double along_m = cameras[i].position_m.x();
    ties.push_back(tie(i, cameras[i], {0.0, turn_rad * along_m, 0.0}));
    ties.back().pose.rotation = Eigen::AngleAxisd(turn_rad, Eigen::Vector3d::UnitZ()) * ties.back().pose.rotation;
  }
  const auto corrections = correctionsBy(ties, cameras, oneAfterTheOther(cameras.size()));
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    const CameraPose moved = corrections[i].of(cameras[i]);
    EXPECT_NEAR(moved.yaw_rad(), turn_rad, 0.003) << i;
    EXPECT_NEAR(moved.position_m.y(), turn_rad * cameras[i].position_m.x(), 0.05) << i;
  }
}

TEST(PoseCorrections, AWrongTieHasNoSay) {
  const auto cameras = straightDrive(40);
  std::vector<PoseTie> ties;
  for (std::size_t i = 0; i < cameras.size(); ++i) ties.push_back(tie(i, cameras[i], {0.3, 0.0, 0.0}));
  ties[20].pose.position_m += Eigen::Vector3d(0.0, 5.0, 0.0);
  const auto corrections = correctionsBy(ties, cameras, oneAfterTheOther(cameras.size()));
  EXPECT_NEAR((corrections[20].shift_m - Eigen::Vector3d(0.3, 0.0, 0.0)).norm(), 0.0, 0.05);
}

TEST(PoseCorrections, HeightsMoveAsAWhole) {
  const auto cameras = straightDrive(300);
  std::vector<PoseTie> ties;
  for (std::size_t i = 0; i < 50; ++i) ties.push_back(tie(i, cameras[i], {0.0, 0.0, -7.0}));
  for (const PoseCorrection& correction : correctionsBy(ties, cameras, oneAfterTheOther(cameras.size()))) {
    EXPECT_NEAR(correction.shift_m.z(), -7.0, 1e-6);
  }
}

TEST(PoseCorrections, AnotherSessionAtTheSamePlaceComesAlong) {
  auto cameras = straightDrive(30);
  const auto again = straightDrive(30);
  cameras.insert(cameras.end(), again.begin(), again.end());
  TiedPairs pairs = oneAfterTheOther(30);
  for (std::size_t i = 1; i < 30; ++i) pairs.emplace_back(30 + i - 1, 30 + i);
  for (std::size_t i = 0; i < 30; ++i) pairs.emplace_back(i, 30 + i);
  std::vector<PoseTie> ties;
  for (std::size_t i = 0; i < 30; ++i) ties.push_back(tie(i, cameras[i], {0.5, 0.2, 0.0}));
  const auto corrections = correctionsBy(ties, cameras, pairs);
  for (std::size_t i = 30; i < 60; ++i)
    EXPECT_NEAR((corrections[i].shift_m - Eigen::Vector3d(0.5, 0.2, 0.0)).norm(), 0.0, 0.05) << i;
}

TEST(PoseCorrection, MovesAPoseBesideItsCameraRigidly) {
  const PoseCorrection correction{Eigen::Quaterniond(Eigen::AngleAxisd(0.5, Eigen::Vector3d::UnitZ())),
                                  {1.0, 2.0, 3.0}};
  const CameraPose camera{levelCamera(0.3), {10.0, 20.0, 1.0}};
  const CameraPose beside{levelCamera(0.4), {11.0, 19.0, 1.5}};
  const CameraPose moved = correction.of(camera);
  const CameraPose moved_beside = correction.of(beside, camera.position_m);
  EXPECT_TRUE(moved.toCamera(moved_beside.position_m).isApprox(camera.toCamera(beside.position_m), 1e-12));
  EXPECT_NEAR(moved_beside.yaw_rad() - moved.yaw_rad(), 0.1, 1e-12);
}

}  // namespace
}  // namespace visual_localization
