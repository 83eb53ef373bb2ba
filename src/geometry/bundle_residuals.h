#pragma once

#include <algorithm>
#include <utility>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <ceres/autodiff_cost_function.h>
#include <ceres/loss_function.h>
#include <ceres/rotation.h>
#include <ceres/sized_cost_function.h>
#include <glog/logging.h>

#include "geometry/bundle_adjustment.h"
#include "geometry/rays.h"

/// What an adjustment makes small, as Ceres takes it.
namespace visual_localization {

/// A step that cannot be solved is tried again with more damping. Ceres warns of each on stderr, but not while one of
/// these lives.
class QuietCeres {
 public:
  QuietCeres() : before_(std::exchange(FLAGS_minloglevel, google::GLOG_ERROR)) {}
  ~QuietCeres() { FLAGS_minloglevel = before_; }
  QuietCeres(const QuietCeres&) = delete;
  QuietCeres& operator=(const QuietCeres&) = delete;

 private:
  int before_;
};

/// w, x, y, z as Ceres takes them.
inline Eigen::Vector4d ceresQuaternion(const Eigen::Quaterniond& q) { return {q.w(), q.x(), q.y(), q.z()}; }

/// How far a camera is turned away from where its mounting on the robot would have it. Parameters: the rotation vector
/// of the camera from `start` (camera_in_map = start * exp(w)), and that of the mounting.
class MountingResidual {
 public:
  /// `travel`: camera_in_map of an upright camera that looks along the direction of travel. `sigma_rad`: of pitch, yaw
  /// and roll.
  MountingResidual(const Eigen::Quaterniond& start, const Eigen::Quaterniond& travel, const Eigen::Vector3d& sigma_rad)
      : travel_from_start_(ceresQuaternion(travel.conjugate() * start)), sigma_rad_(sigma_rad) {}

  template <class T>
  bool operator()(const T* turn, const T* mounting, T* residual) const {
    const T back[3] = {-mounting[0], -mounting[1], -mounting[2]};
    T mounted[4];
    T turned[4];
    T travel_from_start[4];
    T difference[4];
    T product[4];
    for (int i = 0; i < 4; ++i) travel_from_start[i] = T(travel_from_start_[i]);
    ceres::AngleAxisToQuaternion(back, mounted);
    ceres::AngleAxisToQuaternion(turn, turned);
    ceres::QuaternionProduct(travel_from_start, turned, product);
    ceres::QuaternionProduct(mounted, product, difference);
    ceres::QuaternionToAngleAxis(difference, residual);
    for (int i = 0; i < 3; ++i) residual[i] /= T(sigma_rad_[i]);
    return true;
  }

 private:
  Eigen::Vector4d travel_from_start_;
  Eigen::Vector3d sigma_rad_;
};

constexpr double kNearest_m = 0.05;  ///< a landmark closer to a camera's plane than this has no projection

/// Camera parameters: turn[3] (camera_in_map = start * exp(turn)) and position[3]. Landmark: position[3]. Focal scale.
class SightingCost final : public ceres::SizedCostFunction<2, 6, 3, 1> {
 public:
  SightingCost(const Eigen::Matrix3d& map_from_start, const LandmarkSighting& sighting)
      : start_from_map_(map_from_start.transpose()), seen_(sighting.normalised), weight_(1.0 / sighting.sigma) {}

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
    const double inverse_z = 1.0 / point.z();
    const double scale = *parameters[2];
    residual = weight_ * (scale * point.head<2>() * inverse_z - seen_);
    if (derivatives == nullptr) return true;

    Eigen::Matrix<double, 2, 3> by_point;
    by_point << inverse_z, 0.0, -point.x() * inverse_z * inverse_z, 0.0, inverse_z, -point.y() * inverse_z * inverse_z;
    by_point *= scale * weight_;
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
    if (derivatives[2] != nullptr) {
      derivatives[2][0] = weight_ * point.x() * inverse_z;
      derivatives[2][1] = weight_ * point.y() * inverse_z;
    }
    return true;
  }

 private:
  static constexpr int kDerivatives[] = {12, 6, 2};
  static constexpr double kBehind_sigmas = 1e3;

  Eigen::Matrix3d start_from_map_;
  Eigen::Vector2d seen_;
  double weight_;
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

/// Unknowns that are near zero.
template <int kSize>
struct ZeroResidual {
  double sigma;

  template <class T>
  bool operator()(const T* unknown, T* residual) const {
    for (int i = 0; i < kSize; ++i) residual[i] = unknown[i] / T(sigma);
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

/// MountingResidual on the six parameters of a camera.
struct CameraMountingResidual {
  MountingResidual residual_of_turn;

  template <class T>
  bool operator()(const T* camera, const T* mounting, T* residual) const {
    return residual_of_turn(camera, mounting, residual);
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

/// A calibration is about right.
struct FocalResidual {
  template <class T>
  bool operator()(const T* scale, T* residual) const {
    residual[0] = (scale[0] - T(1.0)) / T(0.1);
    return true;
  }
};

}  // namespace visual_localization
