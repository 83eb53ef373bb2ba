#include "geometry/pose_solver.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <random>
#include <set>
#include <utility>

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
constexpr double kSharpness = 16.0;  ///< an inlier's noise is about a quarter of the tolerance
constexpr std::size_t kLeast = 4;
constexpr int kMostSteps = 10;
constexpr int kImprovements = 4;    ///< least squares steps for a better sample
constexpr double kLossScale = 2.5;  ///< sigmas, of the Cauchy loss

// A scene that moves.
constexpr double kMotions_m[] = {0.1, 0.3};  ///< of landmarks since the day of the map
constexpr double kMovingGain = 12.0;         ///< of the logarithm of the likelihood, over that of a rigid scene
constexpr double kMovingStretch = 1.5;       ///< keypoints on what moves are found less well
constexpr double kMovingAlike = 1.5;         ///< plants move in groups: this multiple of the sigmas of one by one
constexpr double kWrongDensity = 1.0;        ///< of wrong matches, by normalised area: 320 x 240 pixels at 266 have 1.1
constexpr double kLeastShare = 0.02;         ///< of right matches, and of wrong ones
constexpr double kLeastWeight = 1e-6;
constexpr double kFarthest_m = 5.0;  ///< from the pose in a rigid scene
constexpr int kExpectations = 8;

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

/// Which matches count where a keypoint may show landmarks of several sessions: those of the session that the pose
/// explains best.
std::vector<bool> ofOneSession(const std::vector<LandmarkMatch>& matches, const CameraPose& pose) {
  std::map<std::size_t, std::pair<double, int>> best;  // of each keypoint: error and session
  for (const LandmarkMatch& match : matches) {
    const std::pair<double, int> found(errorOf(match, pose), match.session);
    const auto known = best.emplace(match.keypoint, found).first;
    known->second = std::min(known->second, found);
  }
  std::vector<bool> counts;
  for (const LandmarkMatch& match : matches) counts.push_back(best.at(match.keypoint).second == match.session);
  return counts;
}

/// How far sights may be off: keypoints and landmarks by `stretch` times what they tell, landmarks by `motion_m`
/// besides.
struct SceneNoise {
  double stretch = 1.0;
  double motion_m = 0.0;
};

/// A match as a pose sees it; normalised coordinates.
struct Residual {
  Eigen::Vector2d projected;
  Eigen::Vector2d error;
  Eigen::Matrix2d covariance;
  Eigen::Matrix2d information;
  Matrix26 jacobian;     ///< by a step of position (map frame) and rotation about the map's axes
  double squared = 0.0;  ///< in sigmas
};

/// Nothing when the landmark is behind the camera.
std::optional<Residual> residualOf(const LandmarkMatch& match, const CameraPose& pose,
                                   const Eigen::Matrix3d& camera_from_map, const SceneNoise& noise = {}) {
  const Eigen::Vector3d offset = match.landmark_m - pose.position_m;
  const Eigen::Vector3d point = camera_from_map * offset;
  if (!(point.z() >= kNearest_m)) return std::nullopt;
  const double inverse_z = 1.0 / point.z();
  Eigen::Matrix<double, 2, 3> by_point;
  by_point << inverse_z, 0.0, -point.x() * inverse_z * inverse_z, 0.0, inverse_z, -point.y() * inverse_z * inverse_z;
  const Eigen::Matrix<double, 2, 3> by_landmark = by_point * camera_from_map;
  Residual residual;
  residual.projected = point.hnormalized();
  residual.error = residual.projected - match.normalised;
  residual.covariance = noise.stretch * noise.stretch *
                            (match.sigma * match.sigma * Eigen::Matrix2d::Identity() +
                             by_landmark * match.covariance_m2 * by_landmark.transpose()) +
                        noise.motion_m * noise.motion_m * by_landmark * by_landmark.transpose();
  residual.information = residual.covariance.inverse();
  residual.jacobian.leftCols<3>() = -by_landmark;
  residual.jacobian.rightCols<3>() = by_landmark * crossMatrix(offset);
  residual.squared = residual.error.dot(residual.information * residual.error);
  return residual;
}

/// Normal equations for a step of position (map frame) and rotation about the map's axes.
struct NormalEquations {
  Matrix6 information = Matrix6::Zero();
  Vector6 gradient = Vector6::Zero();
  double squared_sigmas = 0.0;  ///< sum of the squared residuals
  // The same of the focal length's scale, alone and with the step.
  double focal_information = 0.0;
  double focal_gradient = 0.0;
  Vector6 focal_with_step = Vector6::Zero();

  void add(const Residual& residual, double weight) {
    const Matrix26 by_step = weight * residual.information * residual.jacobian;
    information += residual.jacobian.transpose() * by_step;
    gradient += by_step.transpose() * residual.error;
    squared_sigmas += weight * residual.squared;
    const Eigen::Vector2d by_focal = weight * residual.information * residual.projected;
    focal_information += by_focal.dot(residual.projected);
    focal_gradient += by_focal.dot(residual.error);
    focal_with_step += residual.jacobian.transpose() * by_focal;
  }

  /// Towards the least squares.
  std::optional<Vector6> step() const {
    const Vector6 step = -information.ldlt().solve(gradient);
    return step.allFinite() ? std::optional<Vector6>(step) : std::nullopt;
  }
};

/// Of all inliers, with Cauchy's weights.
NormalEquations equationsOf(const std::vector<LandmarkMatch>& matches, const std::vector<std::size_t>& inliers,
                            const CameraPose& pose) {
  NormalEquations equations;
  const Eigen::Matrix3d camera_from_map = pose.rotation.conjugate().toRotationMatrix();
  for (const std::size_t i : inliers) {
    const std::optional<Residual> residual = residualOf(matches[i], pose, camera_from_map);
    if (residual) equations.add(*residual, 1.0 / (1.0 + residual->squared / (kLossScale * kLossScale)));
  }
  return equations;
}

CameraPose moved(const CameraPose& pose, const Vector6& step) {
  return {(Eigen::Quaterniond(exponential(step.tail<3>())) * pose.rotation).normalized(),
          pose.position_m + step.head<3>()};
}

/// For mostSupported(): the poses that three matches allow.
class PoseEstimator {
 public:
  using Model = CameraPose;
  using Sample = std::array<std::size_t, 3>;
  static constexpr std::size_t kSampleSize = 3;
  static constexpr int kLeastSamples = 30;
  static constexpr int kMostSamples = 200;

  PoseEstimator(const std::vector<LandmarkMatch>& matches, double tolerance)
      : matches_(matches), tolerance_(tolerance) {
    // Relative to their middle, so that OpenCV need not subtract large numbers.
    for (const LandmarkMatch& match : matches) origin_ += match.landmark_m / static_cast<double>(matches.size());
  }

  std::size_t count() const { return matches_.size(); }

  /// At most four, by AP3P (Ke and Roumeliotis 2017).
  std::vector<CameraPose> modelsOf(const Sample& sample, std::minstd_rand&) const {
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

  /// Three points that lie close together, or far away, leave much of a pose to their noise; its inliers know better.
  template <class Keep>
  void improve(const CameraPose& best, std::minstd_rand&, const Keep& keep) const {
    for (int i = 0; i < kImprovements; ++i) {
      const std::vector<std::size_t> inliers = inliersOf(matches_, best, tolerance_);
      if (inliers.size() < kLeast) return;
      const std::optional<Vector6> step = equationsOf(matches_, inliers, best).step();
      if (!step || !keep(moved(best, *step))) return;
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

 private:
  const std::vector<LandmarkMatch>& matches_;
  const double tolerance_;
  Eigen::Vector3d origin_ = Eigen::Vector3d::Zero();
};

/// `equations`: of the inliers at the pose. Nothing when they leave it open.
std::optional<SolvedPose> solvedFrom(const std::vector<LandmarkMatch>& matches, const CameraPose& pose,
                                     std::vector<std::size_t> inliers, const NormalEquations& equations) {
  const Eigen::SelfAdjointEigenSolver<Matrix6> eigen(equations.information);
  if (eigen.info() != Eigen::Success || !(eigen.eigenvalues().minCoeff() > 0.0)) return std::nullopt;
  const double variance = std::max(1.0, equations.squared_sigmas / (2.0 * static_cast<double>(inliers.size())));
  SolvedPose solved;
  solved.camera = pose;
  solved.covariance = eigen.eigenvectors() * eigen.eigenvalues().cwiseInverse().asDiagonal() *
                      eigen.eigenvectors().transpose() * variance;
  const Vector6 by_step = equations.information.ldlt().solve(equations.focal_with_step);
  const double information = equations.focal_information - by_step.dot(equations.focal_with_step);
  solved.focal_scale = 1.0 - (equations.focal_gradient - by_step.dot(equations.gradient)) / information;
  solved.focal_sigma = std::sqrt(variance / information);
  std::vector<double> errors;
  for (const std::size_t i : inliers) errors.push_back(errorOf(matches[i], pose));
  solved.median_error = median(errors);
  solved.agreeing = inliers.size();
  solved.inliers = std::move(inliers);
  return solved.covariance.allFinite() ? std::optional<SolvedPose>(solved) : std::nullopt;
}

/// Least squares on the inliers, which are chosen anew before each step.
std::optional<SolvedPose> refined(const std::vector<LandmarkMatch>& matches, CameraPose pose, double tolerance,
                                  std::size_t min_inliers) {
  for (int i = 0; i < kMostSteps; ++i) {
    const std::vector<std::size_t> inliers = inliersOf(matches, pose, tolerance);
    if (inliers.size() < min_inliers) return std::nullopt;
    const std::optional<Vector6> step = equationsOf(matches, inliers, pose).step();
    if (!step) return std::nullopt;
    pose = moved(pose, *step);
    if (step->head<3>().norm() < 1e-5 && step->tail<3>().norm() < 1e-6) break;
  }
  std::vector<std::size_t> inliers = inliersOf(matches, pose, tolerance);
  if (inliers.size() < min_inliers) return std::nullopt;
  const NormalEquations equations = equationsOf(matches, inliers, pose);
  return solvedFrom(matches, pose, std::move(inliers), equations);
}

/// The pose by all matches, of which some are wrong: right ones are off by the noise, wrong ones are anywhere in the
/// image. By expectation maximisation (Dempster, Laird and Rubin 1977).
class SceneFit {
 public:
  SceneFit(const std::vector<LandmarkMatch>& matches, const SolvedPose& start, const SceneNoise& noise)
      : matches_(matches), noise_(noise), pose_(start.camera) {
    expect(rightShare(static_cast<double>(start.inliers.size())));
    for (int i = 0; i < kExpectations; ++i) {
      const std::optional<Vector6> step = equations_.step();
      if (!step) return;
      pose_ = moved(pose_, *step);
      if (!((pose_.position_m - start.camera.position_m).norm() < kFarthest_m)) return;
      expect(rightShare(right_));
    }
    ended_ = true;
  }

  /// Nothing when it led away.
  std::optional<double> logLikelihood() const { return ended_ ? std::optional<double>(log_likelihood_) : std::nullopt; }

  std::optional<SolvedPose> solved() const { return solvedFrom(matches_, pose_, inliers_, equations_); }
  std::size_t inliers() const { return inliers_.size(); }

 private:
  double rightShare(double right) const {
    return std::clamp(right / static_cast<double>(matches_.size()), kLeastShare, 1.0 - kLeastShare);
  }

  /// Weighs each match by how probably it is right.
  void expect(double right_share) {
    equations_ = {};
    inliers_.clear();
    log_likelihood_ = 0.0;
    right_ = 0.0;
    const Eigen::Matrix3d camera_from_map = pose_.rotation.conjugate().toRotationMatrix();
    for (std::size_t i = 0; i < matches_.size(); ++i) {
      const std::optional<Residual> residual = residualOf(matches_[i], pose_, camera_from_map, noise_);
      const double wrong = (1.0 - right_share) * kWrongDensity;
      const double right = residual ? right_share * densityOf(*residual) : 0.0;
      log_likelihood_ += std::log(right + wrong);
      const double weight = right / (right + wrong);
      right_ += weight;
      if (weight > 0.5) inliers_.push_back(i);
      if (weight > kLeastWeight) equations_.add(*residual, weight);
    }
  }

  static double densityOf(const Residual& residual) {
    return std::exp(-0.5 * residual.squared) / (2.0 * kPi * std::sqrt(residual.covariance.determinant()));
  }

  const std::vector<LandmarkMatch>& matches_;
  const SceneNoise noise_;
  CameraPose pose_;
  NormalEquations equations_;
  std::vector<std::size_t> inliers_;  ///< more probably right than wrong
  double right_ = 0.0;                ///< sum of the weights
  double log_likelihood_ = 0.0;
  bool ended_ = false;
};

/// What the matches say of a scene that moves.
struct MovingScene {
  double gain = 0.0;  ///< of the logarithm of the likelihood, over that of a rigid one; 0: unknown
  std::optional<SolvedPose> pose;
};

/// Plants stand elsewhere than on the day of the map, near ones by many pixels. The few that agree with one pose by
/// chance, to the pixel, are no better than the others: in a scene that moves all of them decide, near ones less.
MovingScene inMovingScene(const std::vector<LandmarkMatch>& matches, const SolvedPose& rigid, std::size_t min_inliers) {
  MovingScene moving;
  const std::optional<double> of_rigid = SceneFit(matches, rigid, {}).logLikelihood();
  if (!of_rigid) return moving;
  for (const double motion_m : kMotions_m) {
    const SceneFit fit(matches, rigid, {kMovingStretch, motion_m});
    const std::optional<double> likelihood = fit.logLikelihood();
    if (!likelihood || fit.inliers() < min_inliers) continue;
    const double gain = *likelihood - *of_rigid;
    if (moving.pose && gain <= moving.gain) continue;
    std::optional<SolvedPose> solved = fit.solved();
    if (solved) moving = {gain, std::move(solved)};
  }
  if (!moving.pose) return moving;
  moving.pose->covariance *= kMovingAlike * kMovingAlike;
  moving.pose->agreeing = rigid.agreeing;
  moving.pose->focal_scale = rigid.focal_scale;  // a wrong calibration must not pass for motion
  moving.pose->focal_sigma = rigid.focal_sigma;
  return moving;
}

/// Landmarks of other sessions that the keypoints of inliers show as well.
void addTheirLike(const std::vector<LandmarkMatch>& matches, const std::vector<bool>& counts, double tolerance,
                  SolvedPose& solved) {
  std::set<std::size_t> keypoints;
  for (const std::size_t i : solved.inliers) keypoints.insert(matches[i].keypoint);
  for (const std::size_t i : inliersOf(matches, solved.camera, tolerance)) {
    if (!counts[i] && keypoints.count(matches[i].keypoint) > 0) solved.inliers.push_back(i);
  }
  std::sort(solved.inliers.begin(), solved.inliers.end());
}

}  // namespace

std::optional<SolvedPose> solvePose(const std::vector<LandmarkMatch>& matches, double tolerance,
                                    std::size_t min_inliers, double moving_evidence) {
  min_inliers = std::max(min_inliers, kLeast);
  if (matches.size() < min_inliers) return std::nullopt;
  const std::optional<CameraPose> start = mostSupported(PoseEstimator(matches, tolerance));
  if (!start) return std::nullopt;
  const std::vector<bool> counts = ofOneSession(matches, *start);
  std::vector<std::size_t> counted;
  std::vector<LandmarkMatch> sights;
  for (std::size_t i = 0; i < matches.size(); ++i) {
    if (!counts[i]) continue;
    counted.push_back(i);
    sights.push_back(matches[i]);
  }
  std::optional<SolvedPose> solved = refined(sights, *start, tolerance, min_inliers);
  if (!solved) return std::nullopt;
  MovingScene moving = inMovingScene(sights, *solved, min_inliers);
  if (moving.pose && moving_evidence + moving.gain > kMovingGain) solved = std::move(moving.pose);
  solved->moving_gain = moving.gain;
  for (std::size_t& i : solved->inliers) i = counted[i];
  addTheirLike(matches, counts, tolerance, *solved);
  return solved;
}

}  // namespace visual_localization
