#include "geometry/pose_solver.h"

#include <cmath>
#include <random>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <gtest/gtest.h>

#include "base/numbers.h"

namespace visual_localization {
namespace {

constexpr double kRaySigma = 0.3 / 450.0;
constexpr double kTolerance = 3.0 / 450.0;
constexpr std::size_t kLeastInliers = 12;

double uniform(std::mt19937& random, double from, double to) {
  return std::uniform_real_distribution<double>(from, to)(random);
}

CameraPose somePose() {
  const Eigen::Quaterniond tilt(Eigen::AngleAxisd(0.1, Eigen::Vector3d(1.0, 0.3, -0.5).normalized()));
  return {levelCamera(0.7) * tilt, {120.0, -340.0, 2.0}};
}

/// Points that the camera sees, each by another keypoint than all others, seen exactly.
std::vector<LandmarkMatch> exactMatches(const CameraPose& pose, std::size_t count, double nearest_m, double farthest_m,
                                        std::mt19937& random) {
  static std::size_t keypoints = 0;
  std::vector<LandmarkMatch> matches(count);
  for (LandmarkMatch& match : matches) {
    match.keypoint = keypoints++;
    const double x = uniform(random, -0.7, 0.7);
    match.normalised = {x, uniform(random, -0.5, 0.5)};
    const double depth_m = uniform(random, nearest_m, farthest_m);
    match.landmark_m = pose.position_m + pose.rotation * (depth_m * match.normalised.homogeneous());
    match.sigma = kRaySigma;
  }
  return matches;
}

/// Known to 1 % along the ray and 0.1 % across it.
void giveCovariances(std::vector<LandmarkMatch>& matches, const CameraPose& pose) {
  for (LandmarkMatch& match : matches) {
    const Eigen::Vector3d offset = match.landmark_m - pose.position_m;
    match.covariance_m2 =
        1e-6 * offset.squaredNorm() * Eigen::Matrix3d::Identity() + 1e-4 * offset * offset.transpose();
  }
}

/// Errors as large as the matches say.
void addNoise(std::vector<LandmarkMatch>& matches, std::mt19937& random) {
  std::normal_distribution<double> normal(0.0, 1.0);
  const auto vector = [&] {
    const double x = normal(random);
    const double y = normal(random);
    return Eigen::Vector3d(x, y, normal(random));
  };
  for (LandmarkMatch& match : matches) {
    match.normalised += match.sigma * vector().head<2>();
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(match.covariance_m2);
    const Eigen::Vector3d sigmas_m = eigen.eigenvalues().cwiseMax(0.0).cwiseSqrt();
    match.landmark_m += eigen.eigenvectors() * sigmas_m.cwiseProduct(vector());
  }
}

/// Position (map frame), then rotation about the map's axes.
Eigen::Matrix<double, 6, 1> errorOf(const CameraPose& solved, const CameraPose& truth) {
  const Eigen::AngleAxisd turn(solved.rotation * truth.rotation.conjugate());
  Eigen::Matrix<double, 6, 1> error;
  error << solved.position_m - truth.position_m, turn.angle() * turn.axis();
  return error;
}

double largestSigma_m(const SolvedPose& solved) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(solved.covariance.topLeftCorner<3, 3>());
  return std::sqrt(eigen.eigenvalues().maxCoeff());
}

TEST(PoseSolver, IsExactWithoutNoise) {
  std::mt19937 random(1);
  const CameraPose truth = somePose();
  const auto solved = solvePose(exactMatches(truth, 40, 4.0, 25.0, random), kTolerance, kLeastInliers);
  ASSERT_TRUE(solved);
  EXPECT_LT(errorOf(solved->camera, truth).norm(), 1e-6);
  EXPECT_EQ(solved->inliers.size(), 40U);
  EXPECT_LT(solved->median_error, 1e-9);
}

TEST(PoseSolver, SolvesWhereAllLandmarksAreOnOnePlane) {
  std::mt19937 random(2);
  const CameraPose truth = somePose();
  auto matches = exactMatches(truth, 40, 1.0, 1.0, random);
  const Eigen::Vector3d normal = Eigen::Vector3d(0.3, -0.2, 1.0).normalized();  // a wall, seen at an angle
  for (LandmarkMatch& match : matches) {
    const Eigen::Vector3d ray = match.normalised.homogeneous();
    match.landmark_m = truth.position_m + truth.rotation * (8.0 / normal.dot(ray) * ray);
  }
  const auto solved = solvePose(matches, kTolerance, kLeastInliers);
  ASSERT_TRUE(solved);
  EXPECT_LT(errorOf(solved->camera, truth).norm(), 1e-6);
}

TEST(PoseSolver, DropsFourOutliersInTen) {
  const CameraPose truth = somePose();
  for (std::uint32_t seed = 0; seed < 20; ++seed) {
    std::mt19937 random(seed);
    auto matches = exactMatches(truth, 60, 4.0, 25.0, random);
    giveCovariances(matches, truth);
    addNoise(matches, random);
    for (std::size_t i = 0; i < 24; ++i) {
      const double x = uniform(random, -0.7, 0.7);
      matches[i].normalised = {x, uniform(random, -0.5, 0.5)};
    }
    const auto solved = solvePose(matches, kTolerance, kLeastInliers);
    ASSERT_TRUE(solved) << seed;
    const Eigen::Matrix<double, 6, 1> error = errorOf(solved->camera, truth);
    EXPECT_LT(error.dot(solved->covariance.inverse() * error), 30.0) << seed << ": 4 in 100 000 are above";
    EXPECT_LT(largestSigma_m(*solved), 0.1) << seed;
  }
}

/// Where all else is far away a pose 0.35 m off has one more inlier: a parked car that has moved by as much. Counting
/// inliers chooses it in 74 of these 100 cases.
TEST(PoseSolver, DoesNotGoAstrayForOneMoreInlier) {
  const CameraPose truth = somePose();
  for (std::uint32_t seed = 0; seed < 100; ++seed) {
    std::mt19937 random(seed);
    auto matches = exactMatches(truth, 36, 40.0, 120.0, random);
    addNoise(matches, random);
    LandmarkMatch moved = exactMatches(truth, 1, 5.0, 8.0, random).front();
    moved.landmark_m += truth.rotation * Eigen::Vector3d(0.35, 0.0, 0.0);
    matches.push_back(moved);
    const auto solved = solvePose(matches, kTolerance, kLeastInliers);
    ASSERT_TRUE(solved);
    EXPECT_LT(errorOf(solved->camera, truth).head<3>().norm(), 0.15) << seed;
  }
}

TEST(PoseSolver, IsNothingWithTooFewInliers) {
  std::mt19937 random(3);
  const CameraPose truth = somePose();
  auto matches = exactMatches(truth, 30, 4.0, 25.0, random);
  for (std::size_t i = kLeastInliers - 1; i < matches.size(); ++i) {
    const double x = uniform(random, -0.7, 0.7);
    matches[i].normalised = {x, uniform(random, -0.5, 0.5)};
  }
  EXPECT_FALSE(solvePose(matches, kTolerance, kLeastInliers + 3)) << "some outliers may fit by accident";
  matches.resize(kLeastInliers - 1);
  EXPECT_FALSE(solvePose(matches, kTolerance, kLeastInliers));
  EXPECT_TRUE(solvePose(matches, kTolerance, kLeastInliers - 1));
  matches.resize(3);
  EXPECT_FALSE(solvePose(matches, kTolerance, 0));
  EXPECT_FALSE(solvePose({}, kTolerance, 0));
}

// A world a hundred times as large looks the same, so the position is known a hundred times less well.
TEST(PoseSolver, SaysHowLittleFarLandmarksTell) {
  const CameraPose truth = somePose();
  std::mt19937 random(4);
  auto matches = exactMatches(truth, 40, 4.0, 25.0, random);
  const auto close = solvePose(matches, kTolerance, kLeastInliers);
  for (LandmarkMatch& match : matches) {
    match.landmark_m = truth.position_m + 100.0 * (match.landmark_m - truth.position_m);
  }
  const auto far = solvePose(matches, kTolerance, kLeastInliers);
  ASSERT_TRUE(close && far);
  EXPECT_NEAR(largestSigma_m(*far) / largestSigma_m(*close), 100.0, 1.0);
  EXPECT_NEAR(std::sqrt(far->covariance(5, 5) / close->covariance(5, 5)), 1.0, 0.01) << "but not the heading";
}

/// Mean over 300 poses of error' covariance^-1 error; 6 when the covariance is right.
double meanNees(double nearest_m, double farthest_m) {
  const CameraPose truth = somePose();
  double sum = 0.0;
  constexpr int kTrials = 300;
  for (int seed = 0; seed < kTrials; ++seed) {
    std::mt19937 random(static_cast<std::uint32_t>(seed));
    auto matches = exactMatches(truth, 40, nearest_m, farthest_m, random);
    giveCovariances(matches, truth);
    addNoise(matches, random);
    const auto solved = solvePose(matches, 3.0 * kTolerance, kLeastInliers);
    if (!solved) return -1.0;
    const Eigen::Matrix<double, 6, 1> error = errorOf(solved->camera, truth);
    sum += error.dot(solved->covariance.ldlt().solve(error));
  }
  return sum / kTrials;
}

// The mean over 300 has a sigma of 0.2. The Cauchy loss gives every match less weight than it has, so the covariance
// is some 25 % too large: about 4.8.
TEST(PoseSolver, KnowsItsCovariance) {
  const double nees = meanNees(4.0, 25.0);
  EXPECT_GT(nees, 4.0);
  EXPECT_LT(nees, 9.0);
}

TEST(PoseSolver, KnowsItsCovarianceWhenAllIsFarAway) {
  const double nees = meanNees(100.0, 300.0);
  EXPECT_GT(nees, 4.0);
  EXPECT_LT(nees, 9.0);
}

/// Each landmark stands elsewhere than on the day of the map.
void move(std::vector<LandmarkMatch>& matches, double sigma_m, std::mt19937& random) {
  std::normal_distribution<double> normal(0.0, 1.0);
  for (LandmarkMatch& match : matches) {
    const double east_m = sigma_m * normal(random);
    const double north_m = sigma_m * normal(random);
    match.landmark_m += Eigen::Vector3d(east_m, north_m, sigma_m * normal(random));
  }
}

// By 0.1 m, 0.01 to 0.03 rad as the camera sees it: a dozen agree with some pose to the 0.007 rad of the tolerance by
// chance, and that pose is wrong. All of them, off by 0.02 rad at 7 m, tell the position to some 0.03 m.
TEST(PoseSolver, IsNotSurerThanLeavesInTheWindAllow) {
  std::mt19937 random(8);
  const CameraPose truth = somePose();
  constexpr int kRuns = 100;
  int within = 0;
  int few_agree = 0;
  double nees = 0.0;
  std::vector<double> errors_m;
  for (int run = 0; run < kRuns; ++run) {
    std::vector<LandmarkMatch> matches = exactMatches(truth, 150, 3.0, 15.0, random);
    move(matches, 0.1, random);
    giveCovariances(matches, truth);
    addNoise(matches, random);
    const auto solved = solvePose(matches, kTolerance, kLeastInliers);
    if (!solved) continue;
    const Eigen::Vector2d error = errorOf(solved->camera, truth).head<2>();
    const Eigen::Matrix2d covariance = solved->covariance.topLeftCorner<2, 2>();
    const double squared_sigmas = error.dot(covariance.inverse() * error);
    within += squared_sigmas <= 9.21 ? 1 : 0;  // 99 % of them
    nees += squared_sigmas;
    few_agree += solved->agreeing < solved->inliers.size() / 2 ? 1 : 0;
    EXPECT_GE(solved->agreeing, kLeastInliers);
    errors_m.push_back(error.norm());
  }
  ASSERT_GT(errors_m.size(), 80U);
  const auto runs = static_cast<double>(errors_m.size());
  EXPECT_GE(within, static_cast<int>(0.95 * runs));
  EXPECT_GT(nees / runs, 0.4) << "2 would be right for leaves that move one by one; 0.9 for those that move in groups";
  EXPECT_LT(nees / runs, 2.0);
  EXPECT_GT(few_agree, static_cast<int>(0.9 * runs)) << "what shows that a pose is no chance counts to the pixel";
  EXPECT_LT(median(errors_m), 0.1);
}

double squaredSigmas(const SolvedPose& solved, const CameraPose& truth) {
  const Eigen::Vector2d error = errorOf(solved.camera, truth).head<2>();
  return error.dot(solved.covariance.topLeftCorner<2, 2>().inverse() * error);
}

// Plants that moved by 0.05 m are a pixel off at 20 m. One image of 25 cannot tell, and is far too sure; what the
// images before told makes it honest.
TEST(PoseSolver, BelievesEarlierImagesThatPlantsMoved) {
  std::mt19937 random(9);
  const CameraPose truth = somePose();
  constexpr int kRuns = 100;
  double nees_alone = 0.0;
  double nees = 0.0;
  int undecided = 0;
  for (int run = 0; run < kRuns; ++run) {
    std::vector<LandmarkMatch> matches = exactMatches(truth, 25, 10.0, 80.0, random);
    move(matches, 0.05, random);
    giveCovariances(matches, truth);
    addNoise(matches, random);
    const auto alone = solvePose(matches, kTolerance, kLeastInliers);
    const auto informed = solvePose(matches, kTolerance, kLeastInliers, 30.0);
    ASSERT_TRUE(alone && informed);
    EXPECT_EQ(alone->moving_gain, informed->moving_gain) << "of this image alone";
    undecided += std::abs(alone->moving_gain) < 12.0 ? 1 : 0;
    nees_alone += squaredSigmas(*alone, truth) / kRuns;
    nees += squaredSigmas(*informed, truth) / kRuns;
  }
  EXPECT_GT(undecided, kRuns / 2);
  EXPECT_GT(nees_alone, 4.0) << "2 would be right";
  EXPECT_GT(nees, 0.1);
  EXPECT_LT(nees, 2.0);
}

// Houses outweigh what the images before told.
TEST(PoseSolver, SeesThatNothingMoved) {
  std::mt19937 random(10);
  const CameraPose truth = somePose();
  std::vector<LandmarkMatch> matches = exactMatches(truth, 100, 4.0, 25.0, random);
  giveCovariances(matches, truth);
  addNoise(matches, random);
  const auto alone = solvePose(matches, kTolerance, kLeastInliers);
  const auto informed = solvePose(matches, kTolerance, kLeastInliers, 30.0);
  ASSERT_TRUE(alone && informed);
  EXPECT_LT(alone->moving_gain, -30.0);
  EXPECT_EQ(informed->covariance, alone->covariance);
}

// The camera may turn around the row and sees the same.
TEST(PoseSolver, DoesNotPretendToKnowThePoseFromARow) {
  const CameraPose truth = somePose();
  for (std::uint32_t seed = 0; seed < 20; ++seed) {
    std::mt19937 random(seed);
    std::vector<LandmarkMatch> matches(5);
    for (std::size_t i = 0; i < matches.size(); ++i) {
      const Eigen::Vector3d in_camera(-2.0 + static_cast<double>(i), 0.5, 8.0 + 0.5 * static_cast<double>(i));
      matches[i].keypoint = i;
      matches[i].landmark_m = truth.position_m + truth.rotation * in_camera;
      const double off = kRaySigma * std::normal_distribution<double>(0.0, 1.0)(random);
      matches[i].normalised = in_camera.hnormalized() + Eigen::Vector2d(off, -0.5 * off);
      matches[i].sigma = kRaySigma;
    }
    const auto solved = solvePose(matches, kTolerance, 4);
    if (solved) {
      EXPECT_GT(largestSigma_m(*solved), 2.0) << seed;
    }
  }
}

/// The same landmarks as another session has them.
std::vector<LandmarkMatch> inAnotherSession(std::vector<LandmarkMatch> matches) {
  for (LandmarkMatch& match : matches) match.session = 1;
  return matches;
}

std::vector<LandmarkMatch> together(std::vector<LandmarkMatch> matches, const std::vector<LandmarkMatch>& others) {
  matches.insert(matches.end(), others.begin(), others.end());
  return matches;
}

TEST(PoseSolver, AKeypointCountsForOneSession) {
  std::mt19937 random(11);
  auto matches = exactMatches(somePose(), 30, 4.0, 25.0, random);
  addNoise(matches, random);
  const auto once = solvePose(matches, kTolerance, kLeastInliers);
  const auto twice = solvePose(together(matches, inAnotherSession(matches)), kTolerance, kLeastInliers);
  ASSERT_TRUE(once && twice);
  EXPECT_EQ(twice->agreeing, once->agreeing);
  EXPECT_LT((twice->covariance - once->covariance).norm(), 1e-3 * once->covariance.norm());
  EXPECT_LT((twice->camera.position_m - once->camera.position_m).norm(), 1e-4);
  EXPECT_EQ(twice->inliers.size(), 2 * once->inliers.size()) << "the landmarks of both agree";
  EXPECT_TRUE(std::is_sorted(twice->inliers.begin(), twice->inliers.end()));
}

TEST(PoseSolver, FewKeypointsThatManySessionsShowAreFew) {
  std::mt19937 random(12);
  const auto matches = exactMatches(somePose(), kLeastInliers - 1, 4.0, 25.0, random);
  EXPECT_FALSE(solvePose(together(matches, inAnotherSession(matches)), kTolerance, kLeastInliers));
}

TEST(PoseSolver, TheSessionThatAgreesCounts) {
  std::mt19937 random(13);
  const CameraPose truth = somePose();
  auto right = exactMatches(truth, 30, 4.0, 25.0, random);
  addNoise(right, random);
  const auto elsewhere = exactMatches(truth, 30, 4.0, 25.0, random);
  auto wrong = inAnotherSession(right);
  for (std::size_t i = 0; i < wrong.size(); ++i) wrong[i].landmark_m = elsewhere[i].landmark_m;
  const auto solved = solvePose(together(wrong, right), kTolerance, kLeastInliers);
  ASSERT_TRUE(solved);
  EXPECT_LT(errorOf(solved->camera, truth).head<3>().norm(), 0.1);
  EXPECT_GE(solved->agreeing, 28U);
  for (const std::size_t i : solved->inliers) EXPECT_GE(i, wrong.size());
}

TEST(PoseSolver, DependsOnTheInputAlone) {
  std::mt19937 random(5);
  const CameraPose truth = somePose();
  auto matches = exactMatches(truth, 40, 4.0, 25.0, random);
  addNoise(matches, random);
  const auto first = solvePose(matches, kTolerance, kLeastInliers);
  solvePose(exactMatches(truth, 20, 4.0, 25.0, random), kTolerance, kLeastInliers);
  const auto second = solvePose(matches, kTolerance, kLeastInliers);
  ASSERT_TRUE(first && second);
  EXPECT_EQ(first->camera.position_m, second->camera.position_m);
  EXPECT_EQ(first->covariance, second->covariance);
}

// All the same, in a row, on the camera, at random: a pose or none, but always numbers.
TEST(PoseSolver, IsAlwaysFinite) {
  const CameraPose truth = somePose();
  for (std::uint32_t seed = 0; seed < 105; ++seed) {
    std::mt19937 random(seed);
    auto matches = exactMatches(truth, 4 + seed % 12, 4.0, 25.0, random);
    for (LandmarkMatch& match : matches) {
      if (seed % 5 == 0) match.landmark_m = matches.front().landmark_m;
      if (seed % 5 == 1) match.landmark_m.tail<2>() = matches.front().landmark_m.tail<2>();
      if (seed % 5 == 2) match.landmark_m = truth.position_m;
      if (seed % 5 == 3) match.normalised = {uniform(random, -0.7, 0.7), 0.0};
      if (seed % 7 == 0) match.normalised = matches.front().normalised;
    }
    const auto solved = solvePose(matches, kTolerance, 4);
    if (!solved) continue;
    EXPECT_TRUE(solved->camera.position_m.allFinite()) << seed;
    EXPECT_TRUE(solved->camera.rotation.coeffs().allFinite()) << seed;
    EXPECT_TRUE(solved->covariance.allFinite()) << seed;
    EXPECT_TRUE(std::isfinite(solved->median_error)) << seed;
  }
}

}  // namespace
}  // namespace visual_localization
