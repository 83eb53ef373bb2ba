// One session as a whole: turned, scaled and shifted, so that all that its images see of each other stays.

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include <Eigen/Geometry>
#include <ceres/autodiff_cost_function.h>
#include <ceres/loss_function.h>
#include <ceres/problem.h>
#include <ceres/solver.h>

#include "geometry/bundle_adjustment.h"
#include "geometry/bundle_residuals.h"
#include "geometry/quiet_ceres.h"

namespace visual_localization {
namespace {

constexpr double kAnything = 1e6;  ///< a sigma that leaves free what nothing determines

/// Turn about the map's axes, logarithm of the scale, shift; about a point.
using Similarity = Eigen::Matrix<double, 7, 1>;

template <class T>
void move(const T* similarity, const Eigen::Vector3d& offset_m, T* moved_m) {
  const T scale = ceres::exp(similarity[3]);
  const T scaled_m[3] = {scale * T(offset_m.x()), scale * T(offset_m.y()), scale * T(offset_m.z())};
  ceres::AngleAxisRotatePoint(similarity, scaled_m, moved_m);
}

/// LeanResidual of a camera that turns with its session.
struct TurnedLeanResidual {
  Eigen::Matrix3d camera_in_map;
  Eigen::Vector3d right;  ///< of the robot, in the frame of the mounting
  double sigma_rad;

  template <class T>
  bool operator()(const T* similarity, const T* correction, T* residual) const {
    const T back[3] = {-correction[0], -correction[1], -correction[2]};
    const T of_robot[3] = {T(right.x()), T(right.y()), T(right.z())};
    Eigen::Matrix<T, 3, 1> in_camera;
    ceres::AngleAxisRotatePoint(back, of_robot, in_camera.data());
    const Eigen::Matrix<T, 3, 1> in_map = camera_in_map.cast<T>() * in_camera;
    T turned[3];
    ceres::AngleAxisRotatePoint(similarity, in_map.data(), turned);
    residual[0] = turned[2] / T(sigma_rad);
    return true;
  }
};

/// TravelResidual of a camera whose way turns with it, so that only the mounting counts.
struct TurnedTravelResidual {
  TravelResidual travel;
  CameraPose before;
  CameraPose behind;

  template <class T>
  bool operator()(const T* correction, T* residual) const {
    const auto parameters = [](const CameraPose& camera) {
      const Eigen::Vector3d& at_m = camera.position_m;
      return std::array<T, 6>{T(0.0), T(0.0), T(0.0), T(at_m.x()), T(at_m.y()), T(at_m.z())};
    };
    return travel(parameters(CameraPose{}).data(), parameters(before).data(), parameters(behind).data(), correction,
                  residual);
  }
};

struct MovedPositionResidual {
  Eigen::Vector3d antenna_m;  ///< from the centre of the session
  Eigen::Vector2d fix_m;      ///< likewise
  double sigma_m;

  template <class T>
  bool operator()(const T* similarity, T* residual) const {
    T moved_m[3];
    move(similarity, antenna_m, moved_m);
    for (int i = 0; i < 2; ++i) residual[i] = (moved_m[i] + similarity[4 + i] - T(fix_m[i])) / T(sigma_m);
    return true;
  }
};

/// SlopeResidual and AltitudeResidual: how far something rises.
struct MovedRiseResidual {
  Eigen::Vector3d way_m;
  double rise_m;
  double sigma_m;

  template <class T>
  bool operator()(const T* similarity, const T* offset, T* residual) const {
    T moved_m[3];
    move(similarity, way_m, moved_m);
    residual[0] = (moved_m[2] + offset[0] - T(rise_m)) / T(sigma_m);
    return true;
  }
};

template <class Residual, int kResiduals, int... kSizes>
ceres::CostFunction* automatic(const Residual& residual) {
  return new ceres::AutoDiffCostFunction<Residual, kResiduals, kSizes...>(new Residual(residual));
}

}  // namespace

void moveAsOne(BundleProblem& problem, const BundleConfig& config) {
  if (problem.cameras.size() < 2 || problem.sessions.size() != 1) return;
  if (std::none_of(problem.positions.begin(), problem.positions.end(), [](const auto& fix) { return fix.believed; }))
    return;
  BundleSession& session = problem.sessions.front();
  std::vector<CameraPose>& cameras = problem.cameras;
  Eigen::Vector3d centre_m = Eigen::Vector3d::Zero();
  for (const CameraPose& camera : cameras) centre_m += camera.position_m / static_cast<double>(cameras.size());
  const auto antennaOf_m = [&](std::size_t i) {
    return Eigen::Vector3d(cameras[i].position_m + cameras[i].rotation * session.antenna_m - centre_m);
  };

  Similarity similarity = Similarity::Zero();
  Eigen::Vector3d correction = session.mounting_rad;
  double height_m = session.fix_height_m - centre_m.z();
  double none_m = 0.0;
  ceres::Problem ceres;
  const Eigen::Vector3d right = session.mounting.conjugate() * Eigen::Vector3d::UnitX();
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    ceres.AddResidualBlock(automatic<TurnedLeanResidual, 1, 7, 3>(
                               {cameras[i].rotation.toRotationMatrix(), right, config.tilt_sigma_rad.z()}),
                           new ceres::CauchyLoss(kTiltLoss), similarity.data(), correction.data());
    if (i + 1 == cameras.size()) continue;
    if (const auto travel = i == 0 ? std::nullopt : travelOf(problem, config, i)) {
      ceres.AddResidualBlock(automatic<TurnedTravelResidual, 2, 3>({*travel, cameras[i - 1], cameras[i + 1]}),
                             new ceres::CauchyLoss(kTiltLoss), correction.data());
    }
    const Eigen::Vector3d way_m = cameras[i + 1].position_m - cameras[i].position_m;
    const SlopeResidual slope = slopeOf(problem, config, i);
    ceres.AddResidualBlock(automatic<MovedRiseResidual, 1, 7, 1>({way_m, slope.rise_m, slope.sigma_m}), nullptr,
                           similarity.data(), &none_m);
  }
  for (const PositionObservation& fix : problem.positions) {
    const Eigen::Vector2d then_m = fix.east_north_m + session.fix_delay_s * fix.velocity_m_s - centre_m.head<2>();
    if (!fix.believed) continue;
    ceres.AddResidualBlock(automatic<MovedPositionResidual, 2, 7>({antennaOf_m(fix.image), then_m, fix.sigma_m}),
                           new ceres::CauchyLoss(config.position_loss), similarity.data());
  }
  for (const HeightObservation& height : problem.heights) {
    ceres.AddResidualBlock(
        automatic<MovedRiseResidual, 1, 7, 1>({antennaOf_m(height.image), height.up_m, height.sigma_m}),
        new ceres::CauchyLoss(kAltitudeLoss), similarity.data(), &height_m);
  }
  ceres.AddResidualBlock(automatic<PriorResidual<3>, 3, 3>({session.mounting_sigma_rad}), nullptr, correction.data());
  ceres.AddResidualBlock(automatic<PriorResidual<7>, 7, 7>({Similarity::Constant(kAnything)}), nullptr,
                         similarity.data());
  ceres.SetParameterBlockConstant(&none_m);
  if (!solveQuietly(ceres::DENSE_QR, ceres).IsSolutionUsable()) return;

  const Eigen::Quaterniond turn(exponential(similarity.head<3>()));
  const double scale = std::exp(similarity[3]);
  const auto moved = [&](const Eigen::Vector3d& point_m) {
    return Eigen::Vector3d(centre_m + scale * (turn * (point_m - centre_m)) + similarity.tail<3>());
  };
  for (CameraPose& camera : cameras) {
    camera = {(turn * camera.rotation).normalized(), moved(camera.position_m)};
  }
  for (Landmark& landmark : problem.landmarks) landmark.position_m = moved(landmark.position_m);
  const double lift_m = cameras.front().position_m.z();  // the first camera is at no height
  for (CameraPose& camera : cameras) camera.position_m.z() -= lift_m;
  for (Landmark& landmark : problem.landmarks) landmark.position_m.z() -= lift_m;
  session.mounting_rad = correction;
  if (!problem.heights.empty()) session.fix_height_m = height_m + centre_m.z() + lift_m;
}

}  // namespace visual_localization
