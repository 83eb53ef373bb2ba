#include "geometry/pose_solver.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <random>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <opencv2/calib3d.hpp>

#include "base/numbers.h"
#include "geometry/ransac.h"
#include "geometry/rays.h"

namespace visual_localization {
namespace {

using Matrix26 = Eigen::Matrix<double, 2, 6>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;
using Vector6 = Eigen::Matrix<double, 6, 1>;

constexpr double kNearest_m = 0.05;
constexpr int kLeastSamples = 30;
constexpr double kSharpness = 16.0;  ///< an inlier's noise is about a quarter of the tolerance
constexpr int kMostSamples = 200;
constexpr std::size_t kLeast = 4;
constexpr int kMostSteps = 10;
constexpr int kImprovements = 4;    ///< least squares steps for a better sample
constexpr double kLossScale = 2.5;  ///< sigmas, of the Cauchy loss

double errorOf(const LandmarkMatch& match, const CameraPose& pose) {
  const Eigen::Vector3d point = pose.toCamera(match.landmark_m);
  if (!(point.z() >= kNearest_m)) return std::numeric_limits<double>::infinity();
  return (point.hnormalized() - match.normalised).norm();
}

std::vector<std::size_t> inliersOf(const std::vector<LandmarkMatch>& matches, const CameraPose& pose,
                                   double tolerance) {
  std::vector<std::size_t> inliers;
  for (std::size_t i = 0; i < matches.size(); ++i) {
    if (errorOf(matches[i], pose) <= tolerance) inliers.push_back(i);
  }
  return inliers;
}

/// Normal equations of all inliers, for a step of position (map frame) and rotation about the map's axes.
struct NormalEquations {
  Matrix6 information = Matrix6::Zero();
  Vector6 gradient = Vector6::Zero();
  double squared_sigmas = 0.0;  ///< mean of the squared residuals
  // The same of the focal length's scale, alone and with the step.
  double focal_information = 0.0;
  double focal_gradient = 0.0;
  Vector6 focal_with_step = Vector6::Zero();

  NormalEquations(const std::vector<LandmarkMatch>& matches, const std::vector<std::size_t>& inliers,
                  const CameraPose& pose) {
    const Eigen::Matrix3d camera_from_map = pose.rotation.conjugate().toRotationMatrix();
    for (const std::size_t i : inliers) add(matches[i], pose, camera_from_map);
    squared_sigmas /= 2.0 * static_cast<double>(inliers.size());
  }

  /// Towards the least squares.
  std::optional<Vector6> step() const {
    const Vector6 step = -information.ldlt().solve(gradient);
    return step.allFinite() ? std::optional<Vector6>(step) : std::nullopt;
  }

 private:
  void add(const LandmarkMatch& match, const CameraPose& pose, const Eigen::Matrix3d& camera_from_map) {
    const Eigen::Vector3d offset = match.landmark_m - pose.position_m;
    const Eigen::Vector3d point = camera_from_map * offset;
    if (!(point.z() >= kNearest_m)) return;
    const double inverse_z = 1.0 / point.z();
    Eigen::Matrix<double, 2, 3> by_point;
    by_point << inverse_z, 0.0, -point.x() * inverse_z * inverse_z, 0.0, inverse_z, -point.y() * inverse_z * inverse_z;
    const Eigen::Matrix<double, 2, 3> by_landmark = by_point * camera_from_map;
    const Eigen::Matrix2d covariance = match.sigma * match.sigma * Eigen::Matrix2d::Identity() +
                                       by_landmark * match.covariance_m2 * by_landmark.transpose();
    Matrix26 jacobian;
    jacobian.leftCols<3>() = -by_landmark;
    jacobian.rightCols<3>() = by_landmark * crossMatrix(offset);
    const Eigen::Vector2d residual = point.hnormalized() - match.normalised;
    const Eigen::Matrix2d inverse = covariance.inverse();
    const double squared = residual.dot(inverse * residual);
    const double weight = 1.0 / (1.0 + squared / (kLossScale * kLossScale));
    information += weight * jacobian.transpose() * inverse * jacobian;
    gradient += weight * jacobian.transpose() * inverse * residual;
    squared_sigmas += weight * squared;
    const Eigen::Vector2d by_focal = inverse * point.hnormalized();
    focal_information += weight * by_focal.dot(point.hnormalized());
    focal_gradient += weight * by_focal.dot(residual);
    focal_with_step += weight * jacobian.transpose() * by_focal;
  }
};

CameraPose moved(const CameraPose& pose, const Vector6& step) {
  return {(Eigen::Quaterniond(exponential(step.tail<3>())) * pose.rotation).normalized(),
          pose.position_m + step.head<3>()};
}

/// RANSAC (Fischler and Bolles 1981) over the poses that three matches allow.
class PoseSampler {
 public:
  PoseSampler(const std::vector<LandmarkMatch>& matches, double tolerance) : matches_(matches), tolerance_(tolerance) {
    // Relative to their middle, so that OpenCV need not subtract large numbers.
    for (const LandmarkMatch& match : matches) origin_ += match.landmark_m / static_cast<double>(matches.size());
  }

  /// That with the best support; the same for the same matches.
  std::optional<CameraPose> best() {
    int samples = kMostSamples;
    for (int i = 0; i < samples; ++i) {
      for (const CameraPose& pose : posesOf(drawDistinct<3>(matches_.size(), random_))) {
        if (!keepIfBest(pose)) continue;
        improveBest();
        const double share = static_cast<double>(most_.inliers) / static_cast<double>(matches_.size());
        samples = samplesNeeded(share, 3, kLeastSamples, kMostSamples);
      }
    }
    return best_;
  }

 private:
  using Sample = std::array<std::size_t, 3>;

  struct Support {
    std::size_t inliers = 0;
    double score = 0.0;  ///< less for an inlier that is farther off (Geman and McClure 1987)
  };

  /// At most four, by AP3P (Ke and Roumeliotis 2017).
  std::vector<CameraPose> posesOf(const Sample& sample) const {
    std::array<cv::Point3d, 3> landmarks;
    std::array<cv::Point2d, 3> seen;
    for (std::size_t k = 0; k < sample.size(); ++k) {
      const LandmarkMatch& match = matches_[sample[k]];
      const Eigen::Vector3d offset = match.landmark_m - origin_;
      landmarks[k] = {offset.x(), offset.y(), offset.z()};
      seen[k] = {match.normalised.x(), match.normalised.y()};
    }
    std::vector<cv::Vec3d> rotations;
    std::vector<cv::Vec3d> translations;
    cv::solveP3P(landmarks, seen, cv::Matx33d::eye(), cv::noArray(), rotations, translations, cv::SOLVEPNP_AP3P);
    std::vector<CameraPose> poses;
    for (std::size_t k = 0; k < rotations.size(); ++k) {
      if (!cv::checkRange(rotations[k]) || !cv::checkRange(translations[k])) continue;
      const Eigen::Vector3d turn(rotations[k][0], rotations[k][1], rotations[k][2]);  // map to camera
      const Eigen::Vector3d shift_m(translations[k][0], translations[k][1], translations[k][2]);
      const Eigen::Quaterniond rotation = Eigen::Quaterniond(exponential(-turn)).normalized();
      poses.push_back({rotation, origin_ - rotation * shift_m});
    }
    return poses;
  }

  bool keepIfBest(const CameraPose& pose) {
    const Support support = supportOf(pose);
    if (support.score <= most_.score) return false;
    best_ = pose;
    most_ = support;
    return true;
  }

  /// Three points that lie close together, or far away, leave much of a pose to their noise; its inliers know better
  /// (Chum, Matas and Kittler 2003).
  void improveBest() {
    for (int i = 0; i < kImprovements; ++i) {
      const std::vector<std::size_t> inliers = inliersOf(matches_, *best_, tolerance_);
      if (inliers.size() < kLeast) return;
      const std::optional<Vector6> step = NormalEquations(matches_, inliers, *best_).step();
      if (!step || !keepIfBest(moved(*best_, *step))) return;
    }
  }

  Support supportOf(const CameraPose& pose) const {
    const Eigen::Matrix3d camera_from_map = pose.rotation.conjugate().toRotationMatrix();
    Support support;
    for (const LandmarkMatch& match : matches_) {
      const Eigen::Vector3d point = camera_from_map * (match.landmark_m - pose.position_m);
      if (!(point.z() >= kNearest_m)) continue;
      const double squared = (point.hnormalized() - match.normalised).squaredNorm() / (tolerance_ * tolerance_);
      if (squared > 1.0) continue;
      ++support.inliers;
      support.score += 1.0 / (1.0 + kSharpness * squared);
    }
    return support;
  }

  const std::vector<LandmarkMatch>& matches_;
  const double tolerance_;
  Eigen::Vector3d origin_ = Eigen::Vector3d::Zero();
  std::minstd_rand random_;
  std::optional<CameraPose> best_;
  Support most_;  ///< of the best
};

/// Least squares on the inliers, which are chosen anew before each step.
std::optional<SolvedPose> refined(const std::vector<LandmarkMatch>& matches, CameraPose pose, double tolerance,
                                  std::size_t min_inliers) {
  for (int i = 0; i < kMostSteps; ++i) {
    const std::vector<std::size_t> inliers = inliersOf(matches, pose, tolerance);
    if (inliers.size() < min_inliers) return std::nullopt;
    const std::optional<Vector6> step = NormalEquations(matches, inliers, pose).step();
    if (!step) return std::nullopt;
    pose = moved(pose, *step);
    if (step->head<3>().norm() < 1e-5 && step->tail<3>().norm() < 1e-6) break;
  }
  SolvedPose solved;
  solved.camera = pose;
  solved.inliers = inliersOf(matches, pose, tolerance);
  if (solved.inliers.size() < min_inliers) return std::nullopt;
  const NormalEquations equations(matches, solved.inliers, pose);
  const Eigen::SelfAdjointEigenSolver<Matrix6> eigen(equations.information);
  if (eigen.info() != Eigen::Success || !(eigen.eigenvalues().minCoeff() > 0.0)) return std::nullopt;
  solved.covariance = eigen.eigenvectors() * eigen.eigenvalues().cwiseInverse().asDiagonal() *
                      eigen.eigenvectors().transpose() * std::max(1.0, equations.squared_sigmas);
  const Vector6 by_step = equations.information.ldlt().solve(equations.focal_with_step);
  const double information = equations.focal_information - by_step.dot(equations.focal_with_step);
  solved.focal_scale = 1.0 - (equations.focal_gradient - by_step.dot(equations.gradient)) / information;
  solved.focal_sigma = std::sqrt(std::max(1.0, equations.squared_sigmas) / information);
  std::vector<double> errors;
  for (const std::size_t i : solved.inliers) errors.push_back(errorOf(matches[i], pose));
  solved.median_error = median(errors);
  return solved.covariance.allFinite() ? std::optional<SolvedPose>(solved) : std::nullopt;
}

}  // namespace

std::optional<SolvedPose> solvePose(const std::vector<LandmarkMatch>& matches, double tolerance,
                                    std::size_t min_inliers) {
  min_inliers = std::max(min_inliers, kLeast);
  if (matches.size() < min_inliers) return std::nullopt;
  const std::optional<CameraPose> start = PoseSampler(matches, tolerance).best();
  return start ? refined(matches, *start, tolerance, min_inliers) : std::nullopt;
}

}  // namespace visual_localization
