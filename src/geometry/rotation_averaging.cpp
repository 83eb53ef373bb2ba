#include <ceres/autodiff_cost_function.h>
#include <ceres/loss_function.h>
#include <ceres/problem.h>
#include <ceres/rotation.h>
#include <ceres/solver.h>

#include "base/numbers.h"
#include "geometry/bundle_residuals.h"
#include "geometry/rays.h"
#include "geometry/relative_rotation.h"
#include "visual_localization/geometry/camera_pose.h"

namespace visual_localization {
namespace {

constexpr double kRelativeSigma_rad = 0.005;
const Eigen::Vector3d kTravelSigma_rad(0.03, 0.08, 0.03);  ///< of one camera about the mounting: pitch, yaw, roll
const Eigen::Vector3d kMountingSigma_rad(0.2, 0.5, 0.05);  ///< of the mounting about none

/// How far two cameras' rotations are from the relative one that their images show.
class RelativeResidual {
 public:
  RelativeResidual(const Eigen::Quaterniond& a_start, const Eigen::Quaterniond& b_start,
                   const Eigen::Quaterniond& b_from_a)
      : a_start_(ceresQuaternion(a_start)),
        b_start_inverse_(ceresQuaternion(b_start.conjugate())),
        a_from_b_(ceresQuaternion(b_from_a.conjugate())) {}

  template <class T>
  bool operator()(const T* turn_a, const T* turn_b, T* residual) const {
    // a_from_b * (b_start exp(turn_b))^-1 * a_start exp(turn_a)
    const T back_b[3] = {-turn_b[0], -turn_b[1], -turn_b[2]};
    T qa[4];
    T qb[4];
    ceres::AngleAxisToQuaternion(turn_a, qa);
    ceres::AngleAxisToQuaternion(back_b, qb);
    T left[4];
    T right[4];
    T middle[4];
    T all[4];
    product(a_start_, qa, right);  // a_start * exp(a)
    product(b_start_inverse_, right, middle);
    ceres::QuaternionProduct(qb, middle, left);
    product(a_from_b_, left, all);
    ceres::QuaternionToAngleAxis(all, residual);
    for (int i = 0; i < 3; ++i) residual[i] /= T(kRelativeSigma_rad);
    return true;
  }

 private:
  template <class T>
  static void product(const Eigen::Vector4d& constant, const T* q, T* result) {
    const T left[4] = {T(constant[0]), T(constant[1]), T(constant[2]), T(constant[3])};
    ceres::QuaternionProduct(left, q, result);
  }

  Eigen::Vector4d a_start_;
  Eigen::Vector4d b_start_inverse_;
  Eigen::Vector4d a_from_b_;
};

/// The mounting is probably that of a level camera that looks ahead.
class MountingPrior {
 public:
  template <class T>
  bool operator()(const T* mounting, T* residual) const {
    for (int i = 0; i < 3; ++i) residual[i] = mounting[i] / T(kMountingSigma_rad[i]);
    return true;
  }
};

}  // namespace

AveragedRotations averageRotations(const std::vector<double>& travel_yaws_rad,
                                   const std::vector<RelativeRotation>& relative) {
  std::vector<Eigen::Quaterniond> travel;
  for (const double yaw_rad : travel_yaws_rad) travel.push_back(levelCamera(yaw_rad));
  std::vector<Eigen::Vector3d> turns(travel.size(), Eigen::Vector3d::Zero());
  AveragedRotations result;

  ceres::Problem problem;
  for (std::size_t i = 0; i < travel.size(); ++i) {
    problem.AddResidualBlock(new ceres::AutoDiffCostFunction<MountingResidual, 3, 3, 3>(
                                 new MountingResidual(travel[i], travel[i], kTravelSigma_rad)),
                             new ceres::CauchyLoss(1.0), turns[i].data(), result.mounting_rad.data());
  }
  for (const RelativeRotation& pair : relative) {
    problem.AddResidualBlock(new ceres::AutoDiffCostFunction<RelativeResidual, 3, 3, 3>(
                                 new RelativeResidual(travel[pair.a], travel[pair.b], pair.b_from_a)),
                             new ceres::CauchyLoss(1.0), turns[pair.a].data(), turns[pair.b].data());
  }
  problem.AddResidualBlock(new ceres::AutoDiffCostFunction<MountingPrior, 3, 3>(new MountingPrior), nullptr,
                           result.mounting_rad.data());
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
  options.max_num_iterations = 100;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);

  for (std::size_t i = 0; i < travel.size(); ++i) {
    const Eigen::Matrix3d rotation = travel[i].toRotationMatrix() * exponential(turns[i]);
    result.camera_in_map.push_back(Eigen::Quaterniond(rotation).normalized());
  }
  return result;
}

}  // namespace visual_localization
