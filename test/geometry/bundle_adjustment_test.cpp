#include "geometry/bundle_adjustment.h"

#include <algorithm>
#include <limits>
#include <random>

#include <gtest/gtest.h>

#include "base/numbers.h"
#include "geometry/rays.h"
#include "test/support/landmark_world.h"

namespace visual_localization {
namespace {

using test::DrivenPose;

constexpr double kSigma = test::kKeypointSigma_px / 450.0;

/// The truth, with observations to `noise` (one sigma, normalised) and a position of sigma 1 m for each image.
BundleProblem truthOf(const std::vector<DrivenPose>& poses, double noise, std::mt19937& random) {
  BundleProblem problem;
  problem.sessions.emplace_back();
  const auto world = test::pointsAlong(poses, 5.0, random);
  std::normal_distribution<double> error(0.0, 1.0);
  std::vector<Landmark> landmarks(world.size());
  for (std::uint32_t i = 0; i < poses.size(); ++i) {
    problem.cameras.push_back(poses[i].camera);
    problem.road.push_back({1.0, 0.0});
    problem.positions.push_back({i, poses[i].camera.position_m.head<2>(), 1.0});
    const test::View view = test::viewOf(world, test::streetCamera(), poses[i].camera, 0.0, random);
    for (std::uint32_t k = 0; k < view.points.size(); ++k) {
      Landmark& landmark = landmarks[view.points[k]];
      landmark.position_m = world[view.points[k]].position_m;
      const double off = noise * error(random);
      const Eigen::Vector2d exact = poses[i].camera.toCamera(landmark.position_m).hnormalized();
      landmark.observations.push_back({i, k, exact + Eigen::Vector2d(off, noise * error(random)), kSigma});
    }
  }
  std::copy_if(landmarks.begin(), landmarks.end(), std::back_inserter(problem.landmarks),
               [](const Landmark& landmark) { return landmark.observations.size() >= 3; });
  return problem;
}

/// Cameras 0.3 m and half a degree off, landmarks 0.3 m.
void disturb(BundleProblem& problem, std::mt19937& random) {
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  const auto vector = [&] {
    const double x = unit(random);
    const double y = unit(random);
    return Eigen::Vector3d(x, y, unit(random));
  };
  for (CameraPose& camera : problem.cameras) {
    camera.position_m += 0.3 * vector();
    camera.rotation = camera.rotation * Eigen::Quaterniond(Eigen::AngleAxisd(0.009, vector().normalized()));
  }
  for (Landmark& landmark : problem.landmarks) landmark.position_m += 0.3 * vector();
}

BundleConfig thorough() {
  BundleConfig config;
  config.max_iterations = 100;
  config.tolerance = 1e-12;
  return config;
}

double pathError_m(const BundleProblem& problem, const std::vector<DrivenPose>& poses) {
  std::vector<Eigen::Vector2d> positions_m;
  for (const CameraPose& camera : problem.cameras) positions_m.emplace_back(camera.position_m.head<2>());
  return test::pathError_m(positions_m, poses);
}

TEST(BundleAdjustment, FindsTheTruthInExactData) {
  std::mt19937 random(1);
  test::StreetDrive street;
  street.images = 25;
  street.turn_rad = 0.0;  // the chord of a bend that begins is not its tangent
  const auto poses = test::drive(street);
  BundleProblem problem = truthOf(poses, 0.0, random);
  const std::vector<Landmark> truth = problem.landmarks;
  disturb(problem, random);
  EXPECT_LT(adjust(problem, thorough()), 1e-6);
  for (std::size_t i = 0; i < poses.size(); ++i) {
    EXPECT_LT((problem.cameras[i].position_m - poses[i].camera.position_m).norm(), 1e-4) << i;
    EXPECT_LT(problem.cameras[i].rotation.angularDistance(poses[i].camera.rotation), 1e-5) << i;
  }
  for (std::size_t i = 0; i < truth.size(); ++i) {
    EXPECT_LT((problem.landmarks[i].position_m - truth[i].position_m).norm(), 1e-2) << i;
  }
}

// Of a mounting that is wrong by 15 degrees the directions of travel and the positions tell.
TEST(BundleAdjustment, FindsHowTheCameraIsMounted) {
  std::mt19937 random(2);
  test::StreetDrive street;
  street.images = 25;
  street.turn_rad = 0.0;  // the chord of a bend that begins is not its tangent
  street.yaw_rad = 15.0 * kPi / 180.0;
  street.pitch_rad = -5.0 * kPi / 180.0;
  const auto poses = test::drive(street);
  BundleProblem problem = truthOf(poses, 0.0, random);
  adjust(problem, thorough());
  const Eigen::Quaterniond mounting = levelCamera(poses[0].travel_yaw_rad).conjugate() * poses[0].camera.rotation;
  const Eigen::Vector3d looks = mounting * Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d found = exponential(problem.sessions.front().mounting_rad) * Eigen::Vector3d::UnitZ();
  // A straight street tells no roll, so all of the 0.0115 rad that yaw and pitch make about the third axis are lost.
  EXPECT_LT((found - looks).norm(), 0.5 * 0.0115);
}

// A camera that is turned by 60 degrees on the robot would explain a lean by its pitch, but not where the robot drives.
TEST(MoveAsOne, TurnsNoMountingAsideToExplainALean) {
  std::mt19937 random(3);
  test::StreetDrive street;
  street.roll_rad = 0.06;
  street.pitch_rad = 0.04;
  BundleProblem problem = truthOf(test::drive(street), 0.0, random);
  moveAsOne(problem, thorough());
  const Eigen::Vector3d& found_rad = problem.sessions.front().mounting_rad;
  EXPECT_NEAR(found_rad.x(), street.pitch_rad, 0.01);
  EXPECT_NEAR(found_rad.y(), 0.0, 0.01);
}

// The images know when the robot turned, the fixes where.
TEST(BundleAdjustment, FindsHowLateTheFixesAre) {
  std::mt19937 random(5);
  const auto poses = test::drive({});
  BundleProblem problem = truthOf(poses, 0.0, random);
  for (PositionObservation& position : problem.positions) {
    const double yaw_rad = poses[position.image].travel_yaw_rad;
    position.velocity_m_s = 4.0 * Eigen::Vector2d(std::cos(yaw_rad), std::sin(yaw_rad));
    position.east_north_m -= 0.15 * position.velocity_m_s;
    position.sigma_m = 0.1;
  }
  adjust(problem, thorough());
  EXPECT_NEAR(problem.sessions.front().fix_delay_s, 0.15, 0.01);
  EXPECT_LT(pathError_m(problem, poses), 0.05);
}

/// Positions that bend aside by 8 m on a third of the way.
void bendPositions(BundleProblem& problem) {
  const std::size_t count = problem.positions.size();
  for (std::size_t i = count / 3; i < 2 * count / 3; ++i) {
    const double share = 3.0 * static_cast<double>(i - count / 3) / static_cast<double>(count);
    problem.positions[i].east_north_m += 8.0 * std::sin(kPi * share) * Eigen::Vector2d(0.6, -0.8);
  }
}

// Of the bend only the two or three fixes on either flank have a say, each less than a third of a metre (Geman and
// McClure), against thirty that are right: centimetres. As much comes from the images, which know the way between the
// fixes to some centimetres.
TEST(BundleAdjustment, BelievesTheImagesWhereFixesBend) {
  std::mt19937 random(3);
  const auto poses = test::drive({});
  BundleProblem problem = truthOf(poses, kSigma, random);
  std::normal_distribution<double> noise(0.0, 0.3);
  for (PositionObservation& position : problem.positions) {
    const double east_m = noise(random);
    position.east_north_m += Eigen::Vector2d(east_m, noise(random));
  }
  bendPositions(problem);
  disturb(problem, random);
  BundleConfig config;
  config.tolerance = 1e-6;
  adjust(problem, config);
  EXPECT_LT(pathError_m(problem, poses), 0.15);
}

TEST(BundleAdjustment, GivesLandmarksBehindACameraNoSay) {
  std::mt19937 random(5);
  test::StreetDrive street;
  street.images = 15;
  const auto poses = test::drive(street);
  BundleProblem problem = truthOf(poses, 0.0, random);
  Landmark behind;
  behind.position_m = poses[7].camera.position_m - 5.0 * poses[7].camera.ahead();
  for (std::uint32_t i = 7; i < 10; ++i) behind.observations.push_back({i, 0, Eigen::Vector2d(0.1, 0.1), kSigma});
  problem.landmarks.push_back(behind);
  adjust(problem, {});
  EXPECT_LT(pathError_m(problem, poses), 1e-3);
}

// What stands still says where the window is; what is not known says nothing, however wrong it is.
TEST(BundleAdjustment, MovesOnlyItsWindow) {
  std::mt19937 random(6);
  test::StreetDrive street;
  street.turn_rad = 0.0;
  const auto poses = test::drive(street);
  BundleProblem problem = truthOf(poses, 0.0, random);
  const BundleProblem truth = problem;
  BundleProblem disturbed = problem;
  disturb(disturbed, random);
  const BundleWindow window{nullptr, 15, 30, 0, 30};
  for (std::size_t i = 0; i < poses.size(); ++i) {
    if (i >= window.begin) problem.cameras[i] = disturbed.cameras[i];
  }
  problem.positions.clear();
  const BundleProblem before = problem;
  EXPECT_LT(adjust(problem, thorough(), window), 1e-6);
  for (std::size_t i = 0; i < poses.size(); ++i) {
    if (window.moves(i)) {
      EXPECT_LT((problem.cameras[i].position_m - truth.cameras[i].position_m).norm(), 1e-4) << i;
      EXPECT_LT(problem.cameras[i].rotation.angularDistance(truth.cameras[i].rotation), 1e-5) << i;
    } else {
      EXPECT_EQ(problem.cameras[i].position_m, before.cameras[i].position_m) << i;
      EXPECT_EQ(problem.cameras[i].rotation.coeffs(), before.cameras[i].rotation.coeffs()) << i;
    }
  }
  for (std::size_t i = 0; i < truth.landmarks.size(); ++i) {
    const auto& observations = truth.landmarks[i].observations;
    const bool seen =
        std::any_of(observations.begin(), observations.end(),
                    [&](const LandmarkObservation& observation) { return window.moves(observation.image); });
    if (seen) continue;
    EXPECT_EQ(problem.landmarks[i].position_m, before.landmarks[i].position_m) << i;
  }
}

TEST(BundleAdjustment, OfNothingChangesNothing) {
  BundleProblem problem;
  problem.sessions.emplace_back();
  EXPECT_EQ(adjust(problem, {}), 0.0);
  problem.cameras.resize(1);
  problem.road.resize(1);
  adjust(problem, {});
  EXPECT_TRUE(problem.cameras[0].position_m.allFinite());
}

TEST(ReprojectionError, IsTheDistanceFromTheProjection) {
  BundleProblem problem;
  problem.sessions.emplace_back();
  problem.lenses = {{{{640, 480}, 100.0, 100.0, 320.0, 240.0, Distortion::kPlumbBob, {}}, LensCorrection::Zero()}};
  problem.cameras.push_back({levelCamera(0.0), {1.0, 2.0, 3.0}});
  const LandmarkObservation observation{0, 0, {323.0, 244.0}, 1.0};
  EXPECT_NEAR(reprojectionError_px(problem, {{6.0, 2.0, 3.0}, {}}, observation), 5.0, 1e-9) << "straight ahead";
  EXPECT_EQ(reprojectionError_px(problem, {{-4.0, 2.0, 3.0}, {}}, observation),
            std::numeric_limits<double>::infinity());
}

}  // namespace
}  // namespace visual_localization
