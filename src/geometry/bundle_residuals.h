#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <ceres/autodiff_cost_function.h>
#include <ceres/loss_function.h>
#include <ceres/rotation.h>
#include <ceres/sized_cost_function.h>

#include "geometry/bundle_adjustment.h"
#include "geometry/bundle_problem.h"
#include "geometry/rays.h"

/// What an adjustment makes small, as Ceres takes it.
namespace visual_localization {

/// w, x, y, z as Ceres takes them.
inline Eigen::Vector4d ceresQuaternion(const Eigen::Quaterniond& q) { return {q.w(), q.x(), q.y(), q.z()}; }

/// The robot's attitude by a camera on it, as a camera has it that looks along the direction of travel (x right, y
/// down, z ahead): camera_in_map = robot * mounting * exp(correction), and camera_in_map = start * exp(turn).
class RobotAttitude {
 public:
  RobotAttitude(const Eigen::Quaterniond& start, const Eigen::Quaterniond& mounting)
      : start_(ceresQuaternion(start)), mounting_inverse_(ceresQuaternion(mounting.conjugate())) {}

  /// robot_in_map, as a quaternion.
  template <class T>
  void of(const T* turn, const T* correction, T* robot) const {
    const T back[3] = {-correction[0], -correction[1], -correction[2]};
    T turned[4];
    T corrected[4];
    T camera[4];
    T product[4];
    const Eigen::Matrix<T, 4, 1> start = start_.cast<T>();
    const Eigen::Matrix<T, 4, 1> mounting_inverse = mounting_inverse_.cast<T>();
    ceres::AngleAxisToQuaternion(turn, turned);
    ceres::AngleAxisToQuaternion(back, corrected);
    ceres::QuaternionProduct(start.data(), turned, camera);
    ceres::QuaternionProduct(camera, corrected, product);
    ceres::QuaternionProduct(product, mounting_inverse.data(), robot);
  }

 private:
  Eigen::Vector4d start_;
  Eigen::Vector4d mounting_inverse_;
};

/// How far a robot is turned away from a direction of travel. Parameters: the camera's turn, and the correction of its
/// mounting.
class MountingResidual {
 public:
  /// `travel`: of a camera that looks along the direction of travel. `sigma_rad`: of pitch, yaw and roll.
  MountingResidual(const RobotAttitude& robot, const Eigen::Quaterniond& travel, const Eigen::Vector3d& sigma_rad)
      : robot_(robot), travel_inverse_(ceresQuaternion(travel.conjugate())), sigma_rad_(sigma_rad) {}

  template <class T>
  bool operator()(const T* turn, const T* correction, T* residual) const {
    T robot[4];
    T difference[4];
    const Eigen::Matrix<T, 4, 1> travel_inverse = travel_inverse_.cast<T>();
    robot_.of(turn, correction, robot);
    ceres::QuaternionProduct(travel_inverse.data(), robot, difference);
    ceres::QuaternionToAngleAxis(difference, residual);
    for (int i = 0; i < 3; ++i) residual[i] /= T(sigma_rad_[i]);
    return true;
  }

 private:
  RobotAttitude robot_;
  Eigen::Vector4d travel_inverse_;
  Eigen::Vector3d sigma_rad_;
};

/// A robot drives where it looks, up and down as well. Parameters: the camera, the one before and the one behind it,
/// and the correction of the mounting.
struct TravelResidual {
  RobotAttitude robot;
  double direction;     ///< 1 ahead, -1 backwards
  double sigma_rad[2];  ///< yaw, pitch

  template <class T>
  bool operator()(const T* camera, const T* before, const T* behind, const T* correction, T* residual) const {
    T attitude[4];
    robot.of(camera, correction, attitude);
    const T inverse[4] = {attitude[0], -attitude[1], -attitude[2], -attitude[3]};
    T way[3];
    T in_robot[3];
    for (int i = 0; i < 3; ++i) way[i] = T(direction) * (behind[3 + i] - before[3 + i]);
    ceres::QuaternionRotatePoint(inverse, way, in_robot);
    const T aside2 = in_robot[0] * in_robot[0] + in_robot[1] * in_robot[1];
    T per_length = T(1.0) / in_robot[2];  // of a small angle
    if (!(in_robot[2] > T(0.0) && aside2 < T(1e-12) * in_robot[2] * in_robot[2])) {
      const T aside = ceres::sqrt(aside2 + T(1e-300));
      per_length = ceres::atan2(aside, in_robot[2]) / aside;
    }
    for (int i = 0; i < 2; ++i) residual[i] = per_length * in_robot[i] / T(sigma_rad[i]);
    return true;
  }
};

/// It leans to no side. Parameters: the camera, and the correction of the mounting.
struct LeanResidual {
  RobotAttitude robot;
  double sigma_rad;

  template <class T>
  bool operator()(const T* camera, const T* correction, T* residual) const {
    T attitude[4];
    robot.of(camera, correction, attitude);
    const T right[3] = {T(1.0), T(0.0), T(0.0)};
    T in_map[3];
    ceres::QuaternionRotatePoint(attitude, right, in_map);
    residual[0] = in_map[2] / T(sigma_rad);
    return true;
  }
};

constexpr double kTiltLoss = 2.0;      ///< sigmas, of the Cauchy loss of a lean or a direction of travel
constexpr double kAltitudeLoss = 2.0;  ///< likewise

/// Camera parameters: turn[3] (camera_in_map = start * exp(turn)) and position[3]. Landmark: position[3]. Lens:
/// LensCorrection[6].
class ReprojectionCost final : public ceres::SizedCostFunction<2, 6, 3, 6> {
 public:
  /// `published` must live longer.
  ReprojectionCost(const Eigen::Matrix3d& map_from_start, const LandmarkObservation& observation,
                   const Intrinsics& published)
      : start_from_map_(map_from_start.transpose()),
        pixel_(observation.pixel),
        weight_(1.0 / observation.sigma_px),
        published_(published) {}

  bool Evaluate(const double* const* parameters, double* residuals, double** derivatives) const override {
    const Eigen::Map<const Eigen::Vector3d> turn(parameters[0]);
    const Eigen::Map<const Eigen::Vector3d> position(parameters[0] + 3);
    const Eigen::Map<const Eigen::Vector3d> landmark(parameters[1]);
    const Eigen::Matrix3d camera_from_map = exponential(-turn) * start_from_map_;
    const Eigen::Vector3d point = camera_from_map * (landmark - position);
    Eigen::Map<Eigen::Vector2d> residual(residuals);
    if (point.z() < kNearest_m) {  // a constant: the robust loss takes its influence
      residual.setConstant(kBehind_sigmas);
      for (int block = 0; derivatives != nullptr && block < 3; ++block) {
        if (derivatives[block] != nullptr) std::fill_n(derivatives[block], kDerivatives[block], 0.0);
      }
      return true;
    }
    const LensProjection lens(published_, Eigen::Map<const LensCorrection>(parameters[2]));
    const bool by_lens = derivatives != nullptr && derivatives[2] != nullptr;
    Eigen::Matrix2d by_ray;
    Eigen::Matrix<double, 2, 6> by_correction;
    residual = weight_ * (lens.project(point.hnormalized(), &by_ray, by_lens ? &by_correction : nullptr) - pixel_);
    if (derivatives == nullptr) return true;

    const double inverse_z = 1.0 / point.z();
    Eigen::Matrix<double, 2, 3> ray_by_point;
    ray_by_point << inverse_z, 0.0, -point.x() * inverse_z * inverse_z, 0.0, inverse_z,
        -point.y() * inverse_z * inverse_z;
    const Eigen::Matrix<double, 2, 3> by_point = weight_ * by_ray * ray_by_point;
    const Eigen::Matrix<double, 2, 3> by_landmark = by_point * camera_from_map;
    if (derivatives[0] != nullptr) {
      Eigen::Map<Eigen::Matrix<double, 2, 6, Eigen::RowMajor>> jacobian(derivatives[0]);
      jacobian.leftCols<3>() = by_point * crossMatrix(point) * rightJacobian(turn);
      jacobian.rightCols<3>() = -by_landmark;
    }
    if (derivatives[1] != nullptr) {
      Eigen::Map<Eigen::Matrix<double, 2, 3, Eigen::RowMajor>> jacobian(derivatives[1]);
      jacobian = by_landmark;
    }
    if (by_lens) {
      Eigen::Map<Eigen::Matrix<double, 2, 6, Eigen::RowMajor>> jacobian(derivatives[2]);
      jacobian = weight_ * by_correction;
    }
    return true;
  }

 private:
  static constexpr int kDerivatives[] = {12, 6, 12};
  static constexpr double kBehind_sigmas = 1e3;

  Eigen::Matrix3d start_from_map_;
  Eigen::Vector2d pixel_;
  double weight_;
  const Intrinsics& published_;
};

/// rho(s) = s / (1 + s / c^2): what is far off has no influence at all (Geman and McClure 1987).
class GemanMcClureLoss final : public ceres::LossFunction {
 public:
  explicit GemanMcClureLoss(double scale) : squared_(scale * scale) {}
  void Evaluate(double s, double rho[3]) const override {
    const double shrink = squared_ / (squared_ + s);
    rho[0] = s * shrink;
    rho[1] = shrink * shrink;
    rho[2] = -2.0 * shrink * shrink * shrink / squared_;
  }

 private:
  double squared_;
};

struct PositionResidual {
  PositionObservation fix;
  Eigen::Matrix3d map_from_start;
  Eigen::Vector3d antenna_m;  ///< in the camera's frame

  template <class T>
  bool operator()(const T* camera, const T* bias, const T* delay, T* residual) const {
    const T antenna[3] = {T(antenna_m.x()), T(antenna_m.y()), T(antenna_m.z())};
    T turned[3];
    ceres::AngleAxisRotatePoint(camera, antenna, turned);
    for (int i = 0; i < 2; ++i) {
      T antenna_in_map = camera[3 + i];
      for (int k = 0; k < 3; ++k) antenna_in_map += T(map_from_start(i, k)) * turned[k];
      const T then = antenna_in_map - delay[0] * T(fix.velocity_m_s[i]);
      residual[i] = (then + bias[i] - T(fix.east_north_m[i])) / T(fix.sigma_m);
    }
    return true;
  }
};

struct AltitudeResidual {
  HeightObservation seen;
  Eigen::Matrix3d map_from_start;
  Eigen::Vector3d antenna_m;  ///< in the camera's frame

  template <class T>
  bool operator()(const T* camera, const T* height, T* residual) const {
    const T antenna[3] = {T(antenna_m.x()), T(antenna_m.y()), T(antenna_m.z())};
    T turned[3];
    ceres::AngleAxisRotatePoint(camera, antenna, turned);
    T antenna_up = camera[5];
    for (int k = 0; k < 3; ++k) antenna_up += T(map_from_start(2, k)) * turned[k];
    residual[0] = (antenna_up + height[0] - T(seen.up_m)) / T(seen.sigma_m);
    return true;
  }
};

/// Roads are not steep, or as steep as altitudes say.
struct SlopeResidual {
  double rise_m;
  double sigma_m;

  template <class T>
  bool operator()(const T* camera, const T* next, T* residual) const {
    residual[0] = (next[5] - camera[5] - T(rise_m)) / T(sigma_m);
    return true;
  }
};

struct HeightResidual {
  double up_m;

  template <class T>
  bool operator()(const T* camera, T* residual) const {
    residual[0] = (camera[5] - T(up_m)) / T(0.01);
    return true;
  }
};

/// From a camera to the next one. A slope goes on for a while: it counts once on its length, not for each image.
inline SlopeResidual slopeOf(const BundleProblem& problem, const BundleConfig& config, std::size_t camera) {
  constexpr double kRoughness_m = 0.01;  // of a level road, from one image to the next
  constexpr double kLength_m = 500.0;
  const Eigen::Vector3d way_m = problem.cameras[camera + 1].position_m - problem.cameras[camera].position_m;
  const double run_m = way_m.head<2>().norm();
  const double correlated_m = std::sqrt(run_m * std::max(run_m, kLength_m));
  return {problem.road[camera].slope * run_m, config.slope_sigma * correlated_m + kRoughness_m};
}

/// Of a camera that has a way.
inline std::optional<TravelResidual> travelOf(const BundleProblem& problem, const BundleConfig& config,
                                              std::size_t camera) {
  constexpr double kWayNoise_m = 0.05;
  const std::optional<Eigen::Vector3d> way_m = wayAt(problem, camera);
  if (!way_m) return std::nullopt;
  const double noise_rad = kWayNoise_m / way_m->norm();
  return TravelResidual{
      RobotAttitude(problem.cameras[camera].rotation, problem.sessionOf(camera).mounting),
      problem.road[camera].direction,
      {std::hypot(config.tilt_sigma_rad.y(), noise_rad), std::hypot(config.tilt_sigma_rad.x(), noise_rad)}};
}

/// Unknowns that are near zero, each to a sigma of its own.
template <int kSize>
struct PriorResidual {
  Eigen::Matrix<double, kSize, 1> sigma;

  template <class T>
  bool operator()(const T* unknown, T* residual) const {
    for (int i = 0; i < kSize; ++i) residual[i] = unknown[i] / T(sigma[i]);
    return true;
  }
};

}  // namespace visual_localization
