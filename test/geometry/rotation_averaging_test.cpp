#include <algorithm>
#include <random>

#include <gtest/gtest.h>

#include "base/numbers.h"
#include "geometry/relative_rotation.h"
#include "test/support/landmark_world.h"

namespace visual_localization {
namespace {

using test::DrivenPose;

/// Of each pose and the next three, exact.
std::vector<RelativeRotation> relativeOf(const std::vector<DrivenPose>& poses) {
  std::vector<RelativeRotation> relative;
  for (std::uint32_t a = 0; a < poses.size(); ++a) {
    for (std::uint32_t b = a + 1; b < poses.size() && b <= a + 3; ++b) {
      relative.push_back({a, b, poses[b].camera.rotation.conjugate() * poses[a].camera.rotation});
    }
  }
  return relative;
}

std::vector<double> travelYawsOf(const std::vector<DrivenPose>& poses) {
  std::vector<double> yaws_rad;
  for (const DrivenPose& pose : poses) yaws_rad.push_back(pose.travel_yaw_rad);
  return yaws_rad;
}

Eigen::Quaterniond randomRotation(std::mt19937& random) {
  std::normal_distribution<double> normal(0.0, 1.0);
  const double w = normal(random);
  const double x = normal(random);
  const double y = normal(random);
  return Eigen::Quaterniond(w, x, y, normal(random)).normalized();
}

double largestError_rad(const AveragedRotations& averaged, const std::vector<DrivenPose>& poses) {
  double largest = 0.0;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    largest = std::max(largest, averaged.camera_in_map[i].angularDistance(poses[i].camera.rotation));
  }
  return largest;
}

TEST(RotationAveraging, IsExactWhenAllAgree) {
  const auto poses = test::drive({});
  const auto averaged = averageRotations(travelYawsOf(poses), relativeOf(poses));
  ASSERT_EQ(averaged.camera_in_map.size(), poses.size());
  EXPECT_LT(largestError_rad(averaged, poses), 1e-6);
  EXPECT_LT(averaged.mounting_rad.norm(), 1e-6);
}

// In the turns a camera that looks up rolls: that tells its pitch far better than the belief that it is level.
TEST(RotationAveraging, FindsThePitchOfTheMountingInTurns) {
  test::StreetDrive street;
  street.pitch_rad = toRadians(5.0);
  const auto poses = test::drive(street);
  const auto averaged = averageRotations(travelYawsOf(poses), relativeOf(poses));
  EXPECT_NEAR(averaged.mounting_rad.x(), street.pitch_rad, toRadians(0.1));
  EXPECT_LT(largestError_rad(averaged, poses), toRadians(0.1));
}

// A residual of many sigmas pulls by 1 / residual, 20 % of them by less than a thousandth of a degree.
TEST(RotationAveraging, IgnoresPairsThatAreWrong) {
  const auto poses = test::drive({});
  auto relative = relativeOf(poses);
  std::mt19937 random(1);
  for (std::size_t i = 0; i < relative.size(); i += 5) relative[i].b_from_a = randomRotation(random);
  const auto averaged = averageRotations(travelYawsOf(poses), relative);
  EXPECT_LT(largestError_rad(averaged, poses), toRadians(0.1));
}

// 20 degrees are 4.4 sigmas of one direction; by the Cauchy loss a fifth of them pull the rest by 0.055 sigmas, which
// are 0.25 degrees.
TEST(RotationAveraging, IgnoresDirectionsOfTravelThatAreWrongInPlaces) {
  const auto poses = test::drive({});
  auto yaws_rad = travelYawsOf(poses);
  for (std::size_t i = 0; i < yaws_rad.size(); ++i) {
    if (i % 25 >= 10 && i % 25 < 15) yaws_rad[i] += toRadians(20.0);
  }
  const auto averaged = averageRotations(yaws_rad, relativeOf(poses));
  EXPECT_LT(largestError_rad(averaged, poses), toRadians(0.5));
}

// Which way a camera looks on its robot cannot be seen from rotations alone: all of them are turned alike.
TEST(RotationAveraging, KeepsTheShapeWhenTheCameraLooksAside) {
  test::StreetDrive street;
  street.yaw_rad = toRadians(15.0);
  const auto poses = test::drive(street);
  const auto averaged = averageRotations(travelYawsOf(poses), relativeOf(poses));
  const Eigen::Quaterniond off = averaged.camera_in_map[0] * poses[0].camera.rotation.conjugate();
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const Eigen::Quaterniond expected = off * poses[i].camera.rotation;
    EXPECT_LT(averaged.camera_in_map[i].angularDistance(expected), toRadians(0.1)) << i;
  }
  EXPECT_LT(std::abs(averaged.mounting_rad.x()), toRadians(0.1));
}

TEST(RotationAveraging, WithoutPairsFollowsTheDirectionsOfTravel) {
  const auto poses = test::drive({});
  EXPECT_LT(largestError_rad(averageRotations(travelYawsOf(poses), {}), poses), 1e-6);
}

TEST(RotationAveraging, OfNothingIsNothing) {
  const auto averaged = averageRotations({}, {});
  EXPECT_TRUE(averaged.camera_in_map.empty());
  EXPECT_TRUE(averaged.mounting_rad.allFinite());
}

}  // namespace
}  // namespace visual_localization
