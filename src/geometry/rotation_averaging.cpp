#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>

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
const Eigen::Vector3d kTravelSigma_rad(0.1, 0.08, 0.03);  ///< of one camera about the mounting: pitch, yaw, roll

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

}  // namespace

Mounting mountingOf(const SensorMount& mount) {
  Mounting mounting;
  mounting.rotation = levelCamera(0.0).conjugate() * mount.camera.rotation;
  const Eigen::Matrix3d robot_from_camera = mounting.rotation.toRotationMatrix();
  const Eigen::Vector3d variances = mounting.sigma_rad.cwiseAbs2();
  mounting.sigma_rad = (robot_from_camera.cwiseAbs2().transpose() * variances).cwiseSqrt();
  return mounting;
}

std::vector<double> drivingDirections(const std::vector<double>& courses_rad,
                                      const std::vector<RelativeRotation>& relative) {
  constexpr double kAbout_rad = 0.75 * kPi;
  std::vector<bool> seen(courses_rad.size());  // with the image before
  for (const RelativeRotation& pair : relative) {
    if (pair.b == pair.a + 1) seen[pair.b] = true;
  }
  std::vector<double> directions(courses_rad.size(), 1.0);
  for (std::size_t i = 1; i < directions.size(); ++i) {
    const bool turns_about = std::abs(angleDifference(courses_rad[i - 1], courses_rad[i])) > kAbout_rad;
    directions[i] = turns_about && seen[i] ? -directions[i - 1] : directions[i - 1];
  }
  const double ahead = std::accumulate(directions.begin(), directions.end(), 0.0);
  if (ahead < 0.0) std::transform(directions.begin(), directions.end(), directions.begin(), std::negate<>());
  return directions;
}

std::optional<Eigen::Quaterniond> mountingByImages(const std::vector<double>& headings_rad,
                                                   const std::vector<double>& directions,
                                                   const std::vector<RelativeRotation>& relative) {
  constexpr double kLeastTurned_rad = 1.5;  // there and back, by neighbouring images
  constexpr double kStraight_rad = 0.05;
  constexpr double kAgreement = 0.7;  // length of the mean of directions
  Eigen::Vector3d up = Eigen::Vector3d::Zero();
  Eigen::Vector3d ahead = Eigen::Vector3d::Zero();
  double turned = 0.0;
  double turned_rad = 0.0;
  double straight = 0.0;
  for (const RelativeRotation& pair : relative) {
    const Eigen::AngleAxisd turn(pair.b_from_a);
    const double heading_rad = angleDifference(headings_rad[pair.a], headings_rad[pair.b]);
    up -= heading_rad * turn.angle() * turn.axis();
    turned += std::abs(heading_rad) * turn.angle();
    if (pair.b == pair.a + 1) turned_rad += turn.angle();
    if (turn.angle() > kStraight_rad || pair.travel.isZero()) continue;
    ahead += directions[pair.b] * pair.travel;
    straight += 1.0;
  }
  const bool turns = turned_rad >= kLeastTurned_rad && up.norm() >= kAgreement * turned;
  if (!turns || ahead.norm() < kAgreement * straight || straight == 0.0) return std::nullopt;
  up.normalize();
  ahead -= ahead.dot(up) * up;
  if (ahead.norm() < kAgreement * straight) return std::nullopt;
  Eigen::Matrix3d robot_from_camera;  // rows: the robot's axes in the camera's frame
  robot_from_camera.row(0) = ahead.normalized();
  robot_from_camera.row(2) = up;
  robot_from_camera.row(1) = up.cross(ahead.normalized());
  return Eigen::Quaterniond(robot_from_camera).normalized();
}

AveragedRotations averageRotations(const std::vector<double>& travel_yaws_rad,
                                   const std::vector<RelativeRotation>& relative, const Mounting& mounting) {
  std::vector<Eigen::Quaterniond> starts;
  for (const double yaw_rad : travel_yaws_rad) starts.push_back(levelCamera(yaw_rad) * mounting.rotation);
  std::vector<Eigen::Vector3d> turns(starts.size(), Eigen::Vector3d::Zero());
  AveragedRotations result;

  ceres::Problem problem;
  for (std::size_t i = 0; i < starts.size(); ++i) {
    problem.AddResidualBlock(new ceres::AutoDiffCostFunction<MountingResidual, 3, 3, 3>(new MountingResidual(
                                 {starts[i], mounting.rotation}, levelCamera(travel_yaws_rad[i]), kTravelSigma_rad)),
                             new ceres::CauchyLoss(1.0), turns[i].data(), result.mounting_rad.data());
  }
  for (const RelativeRotation& pair : relative) {
    problem.AddResidualBlock(new ceres::AutoDiffCostFunction<RelativeResidual, 3, 3, 3>(
                                 new RelativeResidual(starts[pair.a], starts[pair.b], pair.b_from_a)),
                             new ceres::CauchyLoss(1.0), turns[pair.a].data(), turns[pair.b].data());
  }
  problem.AddResidualBlock(
      new ceres::AutoDiffCostFunction<PriorResidual<3>, 3, 3>(new PriorResidual<3>{mounting.sigma_rad}), nullptr,
      result.mounting_rad.data());
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
  options.max_num_iterations = 100;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);

  for (std::size_t i = 0; i < starts.size(); ++i) {
    const Eigen::Matrix3d rotation = starts[i].toRotationMatrix() * exponential(turns[i]);
    result.camera_in_map.push_back(Eigen::Quaterniond(rotation).normalized());
  }
  return result;
}

}  // namespace visual_localization
