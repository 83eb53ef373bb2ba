#include "geometry/pose_solver.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <opencv2/calib3d.hpp>
#include <opencv2/core/eigen.hpp>

#include "base/statistics.h"
#include "geometry/rotation_vector.h"

namespace visual_localization {
namespace {

using Matrix26 = Eigen::Matrix<double, 2, 6>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;
using Vector6 = Eigen::Matrix<double, 6, 1>;

constexpr double kNearest_m = 0.05;
constexpr int kMostSamples = 200;
constexpr double kConfidence = 0.999;
constexpr std::size_t kLeast = 4;
constexpr int kMostSteps = 10;
constexpr double kLossScale = 2.5;  ///< sigmas, of the Cauchy loss

/// Of AP3P in a RANSAC loop. OpenCV seeds it anew in each call.
std::optional<CameraPose> robustPose(const std::vector<LandmarkMatch>& matches, double tolerance) {
  // Relative to their middle, so that OpenCV need not subtract large numbers.
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  for (const LandmarkMatch& match : matches) origin += match.landmark_m / static_cast<double>(matches.size());
  std::vector<cv::Point3d> landmarks;
  std::vector<cv::Point2d> seen;
  for (const LandmarkMatch& match : matches) {
    const Eigen::Vector3d offset = match.landmark_m - origin;
    landmarks.emplace_back(offset.x(), offset.y(), offset.z());
    seen.emplace_back(match.normalised.x(), match.normalised.y());
  }
  cv::Mat rotation_vector;
  cv::Mat translation;
  const bool found = cv::solvePnPRansac(landmarks, seen, cv::Mat::eye(3, 3, CV_64F), cv::noArray(), rotation_vector,
                                        translation, false, kMostSamples, static_cast<float>(tolerance), kConfidence,
                                        cv::noArray(), cv::SOLVEPNP_AP3P);
  if (!found || !cv::checkRange(rotation_vector) || !cv::checkRange(translation)) return std::nullopt;
  cv::Mat rotation;
  cv::Rodrigues(rotation_vector, rotation);
  Eigen::Matrix3d camera_from_map;
  Eigen::Vector3d shift;
  cv::cv2eigen(rotation, camera_from_map);
  cv::cv2eigen(translation, shift);
  CameraPose pose;
  pose.rotation = Eigen::Quaterniond(Eigen::Matrix3d(camera_from_map.transpose())).normalized();
  pose.position_m = origin - pose.rotation * shift;
  return pose;
}

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

/// Least squares on the inliers, which are chosen anew before each step.
std::optional<SolvedPose> refined(const std::vector<LandmarkMatch>& matches, CameraPose pose, double tolerance,
                                  std::size_t min_inliers) {
  for (int i = 0; i < kMostSteps; ++i) {
    const std::vector<std::size_t> inliers = inliersOf(matches, pose, tolerance);
    if (inliers.size() < min_inliers) return std::nullopt;
    const NormalEquations equations(matches, inliers, pose);
    const Vector6 step = -equations.information.ldlt().solve(equations.gradient);
    if (!step.allFinite()) return std::nullopt;
    pose = moved(pose, step);
    if (step.head<3>().norm() < 1e-5 && step.tail<3>().norm() < 1e-6) break;
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
  const std::optional<CameraPose> start = robustPose(matches, tolerance);
  return start ? refined(matches, *start, tolerance, min_inliers) : std::nullopt;
}

}  // namespace visual_localization
