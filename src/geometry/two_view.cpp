#include <algorithm>
#include <array>
#include <cmath>
#include <random>

#include <Eigen/Cholesky>

#include "base/numbers.h"
#include "geometry/ransac.h"
#include "geometry/rays.h"
#include "geometry/relative_rotation.h"

namespace visual_localization {
namespace {

constexpr int kDescentSteps = 8;
constexpr double kSolved = 1e-12;  ///< sum of the squared residuals of a sample that needs no further step
constexpr double kFitted = 0.01;   ///< the same in squared tolerances, of a sample that a motion explains
constexpr int kSubsets = 20;
constexpr std::size_t kSubsetSize = 14;
constexpr int kSubsetSteps = 3;
constexpr int kLastSteps = 10;
constexpr double kReach = 9.0;  ///< squared tolerances, beyond which a match has no influence
/// Squared tolerances at which a match has half the support (Geman and McClure 1987).
constexpr double kHalfSupport = 2.0;

/// The motion between two views; its length is not known.
struct Motion {
  Eigen::Matrix3d b_from_a = Eigen::Matrix3d::Identity();
  Eigen::Vector3d towards_a = Eigen::Vector3d::UnitZ();  ///< from camera b, in its frame, of length 1

  Eigen::Matrix3d essential() const { return crossMatrix(towards_a) * b_from_a; }
};

using Matrix5 = Eigen::Matrix<double, 5, 5>;
using Vector5 = Eigen::Matrix<double, 5, 1>;

/// A step of a motion: a turn about the axes of b, and its direction's along two axes across it.
class MotionStep {
 public:
  explicit MotionStep(const Motion& motion) : motion_(motion) {
    across_.col(0) = motion.towards_a.unitOrthogonal();
    across_.col(1) = motion.towards_a.cross(across_.col(0));
  }

  /// How the epipolar constraint of a match changes with the step: b (towards_a x b_from_a a).
  Vector5 derivative(const Eigen::Vector3d& a, const Eigen::Vector3d& b) const {
    const Eigen::Vector3d turned = motion_.b_from_a * a;
    Vector5 derivative;
    derivative << turned.cross(b.cross(motion_.towards_a)), across_.transpose() * turned.cross(b);
    return derivative;
  }

  Motion taken(const Vector5& step) const {
    return {exponential(step.head<3>()) * motion_.b_from_a,
            (motion_.towards_a + across_ * step.tail<2>()).normalized()};
  }

 private:
  const Motion& motion_;
  Eigen::Matrix<double, 3, 2> across_;
};

/// For mostSupported(): the motions that explain five matches.
class MotionEstimator {
 public:
  using Model = Motion;
  using Sample = std::array<std::size_t, 5>;
  static constexpr std::size_t kSampleSize = 5;
  static constexpr int kLeastSamples = 10;
  static constexpr int kMostSamples = 2000;

  MotionEstimator(const std::vector<Eigen::Vector2d>& a, const std::vector<Eigen::Vector2d>& b,
                  const std::vector<FeatureMatch>& matches, double tolerance)
      : a_(3, matches.size()), b_(3, matches.size()), squared_tolerance_(tolerance * tolerance) {
    for (std::size_t i = 0; i < matches.size(); ++i) {
      a_.col(static_cast<Eigen::Index>(i)) = a[matches[i].a].homogeneous();
      b_.col(static_cast<Eigen::Index>(i)) = b[matches[i].b].homogeneous();
    }
  }

  std::size_t count() const { return static_cast<std::size_t>(a_.cols()); }

  std::vector<Motion> modelsOf(const Sample& sample, std::minstd_rand& random) const {
    const std::optional<Motion> motion = explained(sample, anyDirection(random));
    return motion ? std::vector<Motion>{*motion} : std::vector<Motion>();
  }

  Support supportOf(const Motion& motion) const {
    const Eigen::ArrayXd squared = squaredErrors(motion);
    Support support;
    for (Eigen::Index i = 0; i < squared.size(); ++i) {
      if (squared[i] <= 1.0) ++support.inliers;
      if (squared[i] <= kReach) support.score += weightOf(squared[i]);
    }
    return support;
  }

  /// Ahead of a camera that drives forwards, the least squares have many minima (Vedaldi, Guidi and Soatto 2007).
  /// Subsets of the inliers lead out of a wrong one.
  template <class Keep>
  void improve(const Motion& best, std::minstd_rand& random, const Keep& keep) const {
    for (int i = 0; i < kSubsets; ++i) {
      const std::vector<std::size_t> inliers = inliersOf(best);
      if (inliers.size() <= kSampleSize) return;
      std::vector<std::size_t> subset;
      std::uniform_int_distribution<std::size_t> any(0, inliers.size() - 1);
      for (std::size_t k = 0; k < kSubsetSize; ++k) subset.push_back(inliers[any(random)]);
      Motion motion = best;
      for (int k = 0; k < kSubsetSteps; ++k) motion = stepped(motion, subset);
      keep(refined(motion, 1));
    }
  }

  /// Steps of least squares on all matches within reach, which are chosen anew before each.
  Motion refined(Motion motion, int steps) const {
    for (int i = 0; i < steps; ++i) {
      const Eigen::ArrayXd squared = squaredErrors(motion);
      std::vector<std::size_t> near;
      for (Eigen::Index k = 0; k < squared.size(); ++k) {
        if (squared[k] <= kReach) near.push_back(static_cast<std::size_t>(k));
      }
      motion = stepped(motion, near);
    }
    return motion;
  }

  std::vector<std::size_t> inliersOf(const Motion& motion) const {
    const Eigen::ArrayXd squared = squaredErrors(motion);
    std::vector<std::size_t> inliers;
    for (Eigen::Index i = 0; i < squared.size(); ++i) {
      if (squared[i] <= 1.0) inliers.push_back(static_cast<std::size_t>(i));
    }
    return inliers;
  }

 private:
  /// Four times Sampson's errors (1982), in squared tolerances: where a match is as far from both epipoles, the sum of
  /// the squared distances from both epipolar lines. Not a number at an epipole in both.
  Eigen::ArrayXd squaredErrors(const Motion& motion) const {
    const Eigen::Matrix3d essential = motion.essential();
    const Eigen::Matrix3Xd lines_b = essential * a_;
    const Eigen::Matrix<double, 2, Eigen::Dynamic> lines_a = essential.transpose().topRows<2>() * b_;
    const Eigen::ArrayXd residuals = b_.cwiseProduct(lines_b).colwise().sum().transpose();
    const Eigen::ArrayXd lengths =
        (lines_b.topRows<2>().colwise().squaredNorm() + lines_a.colwise().squaredNorm()).transpose();
    return 4.0 / squared_tolerance_ * residuals.square() / lengths;
  }

  /// Levenberg and Marquardt's descent to where the five lie on their epipolar lines, if it leads there.
  std::optional<Motion> explained(const Sample& sample, const Eigen::Vector3d& start) const {
    Motion motion{Eigen::Matrix3d::Identity(), start};
    Vector5 residuals = residualsOf(sample, motion);
    double damping = 1e-6;
    for (int i = 0; i < kDescentSteps && residuals.squaredNorm() > kSolved; ++i) {
      const MotionStep step(motion);
      Matrix5 jacobian;
      for (std::size_t k = 0; k < kSampleSize; ++k) {
        const auto match = static_cast<Eigen::Index>(sample[k]);
        jacobian.row(static_cast<Eigen::Index>(k)) = step.derivative(a_.col(match), b_.col(match));
      }
      Matrix5 information = jacobian.transpose() * jacobian;
      information.diagonal().array() += damping * information.diagonal().maxCoeff();
      const Motion next = step.taken(-information.ldlt().solve(jacobian.transpose() * residuals));
      const Vector5 next_residuals = residualsOf(sample, next);
      const bool is_better = next_residuals.squaredNorm() < residuals.squaredNorm();
      damping *= is_better ? 0.1 : 10.0;
      if (!is_better) continue;
      motion = next;
      residuals = next_residuals;
    }
    const bool fits = residuals.squaredNorm() <= kFitted * squared_tolerance_;
    return fits ? std::optional<Motion>(motion) : std::nullopt;
  }

  static Eigen::Vector3d anyDirection(std::minstd_rand& random) {
    std::normal_distribution<double> normal;
    const double x = normal(random);
    const double y = normal(random);
    return Eigen::Vector3d(x, y, normal(random)).normalized();
  }

  Vector5 residualsOf(const Sample& sample, const Motion& motion) const {
    const Eigen::Matrix3d essential = motion.essential();
    Vector5 residuals;
    for (std::size_t k = 0; k < kSampleSize; ++k) {
      const auto match = static_cast<Eigen::Index>(sample[k]);
      residuals[static_cast<Eigen::Index>(k)] = b_.col(match).dot(essential * a_.col(match));
    }
    return residuals;
  }

  static double weightOf(double squared_error) { return 1.0 / (1.0 + squared_error / kHalfSupport); }

  /// One step of the least squares on some matches, weighted by their support (Gauss and Newton); the same motion when
  /// they do not determine any.
  Motion stepped(const Motion& motion, const std::vector<std::size_t>& matches) const {
    const Eigen::Matrix3d essential = motion.essential();
    const MotionStep step(motion);
    Matrix5 information = Matrix5::Zero();
    Vector5 gradient = Vector5::Zero();
    for (const std::size_t i : matches) {
      const Eigen::Vector3d a = a_.col(static_cast<Eigen::Index>(i));
      const Eigen::Vector3d b = b_.col(static_cast<Eigen::Index>(i));
      const Eigen::Vector3d line_b = essential * a;
      const Eigen::Vector3d line_a = essential.transpose() * b;
      const double residual = b.dot(line_b);
      const double by_tolerance =
          4.0 / squared_tolerance_ / (line_b.head<2>().squaredNorm() + line_a.head<2>().squaredNorm());
      const double support = weightOf(by_tolerance * residual * residual);
      const Vector5 derivative = step.derivative(a, b);
      information += by_tolerance * support * support * derivative * derivative.transpose();
      gradient += by_tolerance * support * support * residual * derivative;
    }
    information.diagonal() *= 1.0 + 1e-6;
    const Vector5 solved = -information.ldlt().solve(gradient);
    return solved.allFinite() ? step.taken(solved) : motion;
  }

  Eigen::Matrix3Xd a_;  ///< homogeneous, of each match
  Eigen::Matrix3Xd b_;
  double squared_tolerance_;
};

/// Of the two rotations of an essential matrix, b from a, the smaller.
Eigen::Quaterniond smallerRotation(const Motion& motion) {
  const Eigen::Quaterniond one(motion.b_from_a);
  const Eigen::Quaterniond half_turn(Eigen::AngleAxisd(kPi, motion.towards_a));
  const Eigen::Quaterniond other = half_turn * one;
  return (std::abs(one.w()) >= std::abs(other.w()) ? one : other).normalized();
}

/// From camera a to b, in the frame of b, so that most points are before both cameras.
Eigen::Vector3d travelOf(const Eigen::Quaterniond& b_from_a, const Eigen::Vector3d& towards_a,
                         const std::vector<Eigen::Vector2d>& a, const std::vector<Eigen::Vector2d>& b,
                         const std::vector<FeatureMatch>& inliers) {
  int votes = 0;
  for (const FeatureMatch& match : inliers) {
    const Eigen::Vector3d from_a = b_from_a * a[match.a].homogeneous();
    const Eigen::Vector3d from_b = b[match.b].homogeneous();
    const Eigen::Vector3d normal = from_b.cross(from_a);
    const bool before_a = towards_a.cross(from_b).dot(normal) > 0.0;
    const bool before_b = towards_a.cross(from_a).dot(normal) > 0.0;
    if (before_a == before_b) votes += before_a ? 1 : -1;
  }
  return votes < 0 ? towards_a : Eigen::Vector3d(-towards_a);
}

}  // namespace

std::optional<TwoView> verifyTwoViews(const std::vector<Eigen::Vector2d>& a, const std::vector<Eigen::Vector2d>& b,
                                      const std::vector<FeatureMatch>& matches, double tolerance,
                                      std::size_t min_inliers, double max_rotation_rad) {
  if (matches.size() < std::max(min_inliers, MotionEstimator::kSampleSize + 1)) return std::nullopt;
  const MotionEstimator estimator(a, b, matches, tolerance);
  std::optional<Motion> motion = mostSupported(estimator);
  if (!motion) return std::nullopt;
  const Motion refined = estimator.refined(*motion, kLastSteps);
  if (estimator.supportOf(refined).score > estimator.supportOf(*motion).score) motion = refined;
  TwoView view;
  view.b_from_a = smallerRotation(*motion);
  for (const std::size_t i : estimator.inliersOf(*motion)) view.inliers.push_back(matches[i]);
  view.travel = travelOf(view.b_from_a, motion->towards_a, a, b, view.inliers);
  const double turn_rad = view.b_from_a.angularDistance(Eigen::Quaterniond::Identity());
  if (view.inliers.size() < min_inliers || !(turn_rad <= max_rotation_rad)) return std::nullopt;
  return view;
}

}  // namespace visual_localization
