#include "geometry/pose_corrections.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <utility>

#include <Eigen/Cholesky>
#include <ceres/autodiff_cost_function.h>
#include <ceres/loss_function.h>
#include <ceres/problem.h>
#include <ceres/solver.h>

#include "base/numbers.h"
#include "geometry/quiet_ceres.h"
#include "geometry/rays.h"

namespace visual_localization {
namespace {

constexpr double kTieLoss = 2.0;       ///< sigmas
constexpr double kStepNoise_m = 0.01;  ///< of cameras at the same position in relation to each other
constexpr double kStepNoise_rad = 1e-3;

using Vector6 = Eigen::Matrix<double, 6, 1>;
using Parameters = std::array<double, 6>;  ///< shift, then turn as a rotation vector

/// Position, then rotation vector, from `from` to `to`, about the map's axes.
Vector6 difference(const CameraPose& from, const CameraPose& to) {
  const Eigen::AngleAxisd turn(to.rotation * from.rotation.conjugate());
  Vector6 difference;
  difference << to.position_m - from.position_m, turn.angle() * turn.axis();
  return difference;
}

/// A correction against what the tie asks for.
struct TieResidual {
  Vector6 wanted;
  Eigen::Matrix<double, 6, 6> whitening;

  template <class T>
  bool operator()(const T* correction, T* residual) const {
    const Eigen::Map<const Eigen::Matrix<T, 6, 1>> of_camera(correction);
    Eigen::Map<Eigen::Matrix<T, 6, 1>> whitened(residual);
    whitened = whitening.cast<T>() * (of_camera - wanted.cast<T>());
    return true;
  }
};

/// Two cameras keep what they have seen of each other, to first order in the turns.
struct NeighbourResidual {
  Eigen::Vector3d way_m;  ///< from a to b
  double sigma_m;
  double sigma_rad;

  template <class T>
  bool operator()(const T* a, const T* b, T* residual) const {
    using Vector = Eigen::Matrix<T, 3, 1>;
    const Eigen::Map<const Vector> shift_a(a);
    const Eigen::Map<const Vector> turn_a(a + 3);
    const Eigen::Map<const Vector> shift_b(b);
    const Eigen::Map<const Vector> turn_b(b + 3);
    Eigen::Map<Vector> of_shift(residual);
    Eigen::Map<Vector> of_turn(residual + 3);
    const Vector way = way_m.cast<T>();
    of_shift = (shift_b - shift_a - turn_a.cross(way)) / T(sigma_m);
    of_turn = (turn_b - turn_a) / T(sigma_rad);
    return true;
  }
};

/// No correction is the most likely one.
struct NoneResidual {
  double weight_per_m;
  double weight_per_rad;

  template <class T>
  bool operator()(const T* correction, T* residual) const {
    for (int i = 0; i < 3; ++i) {
      residual[i] = T(weight_per_m) * correction[i];
      residual[i + 3] = T(weight_per_rad) * correction[i + 3];
    }
    return true;
  }
};

template <class Residual, int... kSizes>
ceres::CostFunction* automatic(const Residual& residual) {
  return new ceres::AutoDiffCostFunction<Residual, 6, kSizes...>(new Residual(residual));
}

/// How much of the path each camera stands for, metres.
std::vector<double> lengthsOf_m(const std::vector<CameraPose>& cameras,
                                const std::vector<std::pair<std::size_t, std::size_t>>& neighbours) {
  std::vector<double> lengths_m(cameras.size(), 0.0);
  for (const auto& [a, b] : neighbours) {
    if (b != a + 1) continue;  // another session at the same place
    const double half_m = 0.5 * (cameras[b].position_m - cameras[a].position_m).norm();
    lengths_m[a] += half_m;
    lengths_m[b] += half_m;
  }
  return lengths_m;
}

double medianRise_m(const std::vector<PoseTie>& ties, const std::vector<CameraPose>& cameras) {
  std::vector<double> rises_m;
  for (const PoseTie& tie : ties) rises_m.push_back(tie.pose.position_m.z() - cameras[tie.camera].position_m.z());
  return median(std::move(rises_m));
}

/// The problem as Ceres takes it.
class Corrector {
 public:
  Corrector(const std::vector<CameraPose>& cameras, const CorrectionModel& model)
      : cameras_(cameras), model_(model), parameters_(cameras.size(), Parameters{}), ceres_(borrowedLoss()) {}

  void addTies(const std::vector<PoseTie>& ties) {
    rise_m_ = medianRise_m(ties, cameras_);
    for (const PoseTie& tie : ties) {
      Vector6 wanted = difference(cameras_[tie.camera], tie.pose);
      wanted.z() -= rise_m_;
      const Eigen::LLT<Eigen::Matrix<double, 6, 6>> information(tie.covariance.inverse());
      ceres_.AddResidualBlock(automatic<TieResidual, 6>({wanted, information.matrixU()}), &loss_,
                              parameters_[tie.camera].data());
    }
  }

  void addNeighbours(const std::vector<std::pair<std::size_t, std::size_t>>& neighbours) {
    for (const auto& [a, b] : neighbours) {
      const Eigen::Vector3d way_m = cameras_[b].position_m - cameras_[a].position_m;
      const double share = std::sqrt(2.0 * way_m.norm() / model_.length_m);
      const NeighbourResidual residual{way_m, std::hypot(kStepNoise_m, model_.sigma_m * share),
                                       std::hypot(kStepNoise_rad, model_.sigma_rad * share)};
      ceres_.AddResidualBlock(automatic<NeighbourResidual, 6, 6>(residual), nullptr, parameters_[a].data(),
                              parameters_[b].data());
    }
    addPriors(lengthsOf_m(cameras_, neighbours));
  }

  std::vector<PoseCorrection> solve() {
    solveQuietly(ceres::SPARSE_NORMAL_CHOLESKY, ceres_);
    std::vector<PoseCorrection> corrections(cameras_.size());
    for (std::size_t i = 0; i < cameras_.size(); ++i) {
      const Eigen::Map<const Vector6> solved(parameters_[i].data());
      corrections[i].turn = Eigen::Quaterniond(exponential(solved.tail<3>()));
      corrections[i].shift_m = solved.head<3>() + Eigen::Vector3d(0.0, 0.0, rise_m_);
    }
    return corrections;
  }

 private:
  static ceres::Problem::Options borrowedLoss() {
    ceres::Problem::Options options;
    options.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
    return options;
  }

  void addPriors(const std::vector<double>& lengths_m) {
    for (std::size_t i = 0; i < cameras_.size(); ++i) {
      const double share = std::sqrt(std::max(kStepNoise_m, lengths_m[i]) / (2.0 * model_.length_m));
      const NoneResidual residual{share / model_.sigma_m, share / model_.sigma_rad};
      ceres_.AddResidualBlock(automatic<NoneResidual, 6>(residual), nullptr, parameters_[i].data());
    }
  }

  const std::vector<CameraPose>& cameras_;
  const CorrectionModel& model_;
  double rise_m_ = 0.0;
  std::vector<Parameters> parameters_;
  ceres::CauchyLoss loss_{kTieLoss};
  ceres::Problem ceres_;
};

}  // namespace

std::vector<PoseCorrection> correctionsBy(const std::vector<PoseTie>& ties, const std::vector<CameraPose>& cameras,
                                          const std::vector<std::pair<std::size_t, std::size_t>>& neighbours,
                                          const CorrectionModel& model) {
  if (ties.empty()) return std::vector<PoseCorrection>(cameras.size());
  Corrector corrector(cameras, model);
  corrector.addTies(ties);
  corrector.addNeighbours(neighbours);
  return corrector.solve();
}

}  // namespace visual_localization
