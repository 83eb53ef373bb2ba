#include "geometry/bundle_adjustment.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <utility>

#include <Eigen/Cholesky>
#include <Eigen/SparseCholesky>
#include <ceres/autodiff_cost_function.h>
#include <ceres/crs_matrix.h>
#include <ceres/loss_function.h>
#include <ceres/problem.h>
#include <ceres/rotation.h>
#include <ceres/sized_cost_function.h>
#include <ceres/solver.h>

#include "base/numbers.h"
#include "geometry/bundle_residuals.h"
#include "geometry/rays.h"

namespace visual_localization {
namespace {

/// The problem as Ceres takes it. Losses and parameters must live as long as Ceres works on it.
class Adjustment {
 public:
  Adjustment(BundleProblem& problem, const BundleConfig& config, const BundleWindow& window)
      : problem_(problem),
        config_(config),
        window_(window),
        sighting_loss_(config.landmark_loss),
        tilt_loss_(kTiltLoss),
        position_loss_(config.position_loss),
        doubtful_position_loss_(config.position_loss),
        altitude_loss_(kAltitudeLoss),
        ceres_(borrowedLosses()) {
    for (const CameraPose& camera : problem.cameras) {
      const Eigen::Vector3d& position = camera.position_m;
      sessions_.push_back(static_cast<std::size_t>(&problem.sessionOf(sessions_.size()) - problem.sessions.data()));
      starts_.push_back(camera.rotation.toRotationMatrix());
      cameras_.push_back({0.0, 0.0, 0.0, position.x(), position.y(), position.z()});
    }
    addSightings();
    addPositions();
    addHeights();
    addPriors();
    holdOthers();
  }

  double solve() {
    const ceres::Solver::Options options = solverOptions();
    ceres::Solver::Summary summary;
    const QuietCeres quiet;
    ceres::Solve(options, &ceres_, &summary);
    for (std::size_t i = 0; i < cameras_.size(); ++i) {
      if (!window_.moves(i)) continue;
      const Eigen::Map<const Eigen::Vector3d> turn(cameras_[i].data());
      const Eigen::Map<const Eigen::Vector3d> position(cameras_[i].data() + 3);
      problem_.cameras[i] = {Eigen::Quaterniond(Eigen::Matrix3d(starts_[i] * exponential(turn))).normalized(),
                             position};
    }
    return summary.final_cost;
  }

  /// Standard deviations of the entries of some parameter blocks, one after the other; zero for those that are held.
  std::vector<double> sigmasOf(const std::vector<std::pair<double*, int>>& blocks) {
    ceres::Problem::EvaluateOptions options;
    std::map<double*, Eigen::Index> columns;
    Eigen::Index count = 0;
    ceres_.GetParameterBlocks(&options.parameter_blocks);
    auto& all = options.parameter_blocks;
    all.erase(std::remove_if(all.begin(), all.end(), [this](double* b) { return ceres_.IsParameterBlockConstant(b); }),
              all.end());
    for (double* block : all) {
      columns[block] = count;
      count += ceres_.ParameterBlockSize(block);
    }
    ceres::CRSMatrix rows;
    if (all.empty() || !ceres_.Evaluate(options, nullptr, nullptr, nullptr, &rows)) return {};
    const Eigen::Map<const Eigen::SparseMatrix<double, Eigen::RowMajor>> jacobian(
        rows.num_rows, rows.num_cols, static_cast<Eigen::Index>(rows.values.size()), rows.rows.data(), rows.cols.data(),
        rows.values.data());
    const Eigen::SparseMatrix<double> by_column = jacobian;
    Eigen::SparseMatrix<double> information = by_column.transpose() * by_column;
    for (Eigen::Index i = 0; i < count; ++i) information.coeffRef(i, i) += kRegular;
    const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver(information);
    std::vector<double> sigmas;
    for (const auto& [block, size] : blocks) {
      const auto column = columns.find(block);
      for (int i = 0; i < size; ++i) {
        sigmas.push_back(0.0);
        if (column == columns.end() || solver.info() != Eigen::Success) continue;
        const Eigen::Index k = column->second + i;
        sigmas.back() = std::sqrt(std::max(0.0, Eigen::VectorXd(solver.solve(Eigen::VectorXd::Unit(count, k)))[k]));
      }
    }
    return sigmas;
  }

  /// Parameters of some that move, spread over all.
  std::vector<std::pair<double*, int>> someCameras() {
    constexpr std::size_t kSome = 7;
    std::vector<std::pair<double*, int>> moving;
    for (std::size_t i = 0; i < cameras_.size(); ++i) {
      if (window_.moves(i)) moving.emplace_back(cameras_[i].data(), 6);
    }
    std::vector<std::pair<double*, int>> some;
    const std::size_t stride = strideFor(moving.size(), kSome);
    for (std::size_t i = stride / 2; i < moving.size(); i += stride) some.push_back(moving[i]);
    return some;
  }

 private:
  static constexpr double kRegular = 1e-9;  ///< on the diagonal: a landmark at a great distance is hardly determined

  template <class Residual, int kResiduals, int... kSizes>
  static ceres::CostFunction* automatic(const Residual& residual) {
    return new ceres::AutoDiffCostFunction<Residual, kResiduals, kSizes...>(new Residual(residual));
  }

  static ceres::Problem::Options borrowedLosses() {
    ceres::Problem::Options options;
    options.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
    return options;
  }

  /// A camera that moves shows it, and another one that is known.
  bool isSeen(const Landmark& landmark) const {
    std::size_t known = 0;
    bool moves = false;
    for (const LandmarkSighting& sighting : landmark.sightings) {
      known += window_.knows(sighting.image) ? 1 : 0;
      moves = moves || window_.moves(sighting.image);
    }
    return moves && known >= 2;
  }

  void addSightings() {
    for (Landmark& landmark : problem_.landmarks) {
      if (!isSeen(landmark)) continue;
      landmarks_.push_back(landmark.position_m.data());
      for (const LandmarkSighting& sighting : landmark.sightings) {
        if (!window_.knows(sighting.image)) continue;
        BundleLens& lens = problem_.lenses[problem_.sessions[sessions_[sighting.image]].lens];
        ceres_.AddResidualBlock(new SightingCost(starts_[sighting.image], sighting, lens.published), &sighting_loss_,
                                cameras_[sighting.image].data(), landmark.position_m.data(), lens.correction.data());
      }
    }
    const bool are_free = !config_.lens_sigma.isZero(0.0);
    for (BundleLens& lens : problem_.lenses) {
      double* correction = lens.correction.data();
      if (!ceres_.HasParameterBlock(correction)) continue;
      if (are_free) {
        ceres_.AddResidualBlock(automatic<PriorResidual<6>, 6, 6>({config_.lens_sigma}), nullptr, correction);
      } else {
        ceres_.SetParameterBlockConstant(correction);
      }
    }
  }

  ceres::LossFunction* lossOf(const PositionObservation& position) {
    if (position.believed) return &position_loss_;
    return &doubtful_position_loss_;
  }

  void addPositions() {
    for (const PositionObservation& position : problem_.positions) {
      if (!window_.moves(position.image)) continue;
      BundleSession& session = problem_.sessions[sessions_[position.image]];
      const PositionResidual residual{position, starts_[position.image], session.antenna_m};
      ceres_.AddResidualBlock(automatic<PositionResidual, 2, 6, 2, 1>(residual), lossOf(position),
                              cameras_[position.image].data(), session.fix_bias_m.data(), &session.fix_delay_s);
    }
    for (BundleSession& session : problem_.sessions) {
      double* bias = session.fix_bias_m.data();
      double* delay = &session.fix_delay_s;
      if (!ceres_.HasParameterBlock(bias)) continue;
      ceres_.AddResidualBlock(automatic<PriorResidual<2>, 2, 2>({Eigen::Vector2d::Constant(session.fix_bias_sigma_m)}),
                              nullptr, bias);
      if (problem_.sessions.size() == 1) ceres_.SetParameterBlockConstant(bias);
      ceres_.AddResidualBlock(
          automatic<PriorResidual<1>, 1, 1>({Eigen::Matrix<double, 1, 1>(session.fix_delay_sigma_s)}), nullptr, delay);
    }
  }

  void addHeights() {
    for (const HeightObservation& height : problem_.heights) {
      if (!window_.moves(height.image)) continue;
      BundleSession& session = problem_.sessions[sessions_[height.image]];
      const AltitudeResidual residual{height, starts_[height.image], session.antenna_m};
      ceres_.AddResidualBlock(automatic<AltitudeResidual, 1, 6, 1>(residual), &altitude_loss_,
                              cameras_[height.image].data(), &session.fix_height_m);
    }
  }

  void addPriors() {
    for (std::size_t i = 0; i < cameras_.size(); ++i) {
      if (window_.moves(i)) addTravel(i);
      if (i + 1 < cameras_.size() && sessions_[i + 1] == sessions_[i]) addSlope(i);
    }
    for (BundleSession& session : problem_.sessions) {
      double* correction = session.mounting_rad.data();
      if (!ceres_.HasParameterBlock(correction)) continue;
      ceres_.AddResidualBlock(automatic<PriorResidual<3>, 3, 3>({session.mounting_sigma_rad}), nullptr, correction);
    }
    anchorHeights();
  }

  /// The first camera of all is at no height; where nothing stands still, the first one that moves keeps its own.
  void anchorHeights() {
    std::size_t first = cameras_.size();
    bool anchored = false;
    for (std::size_t i = cameras_.size(); i-- > 0;) {
      if (window_.moves(i)) {
        first = i;
      } else {
        anchored = anchored || window_.knows(i);
      }
    }
    if (first == cameras_.size() || (first > 0 && anchored)) return;
    const double up_m = first == 0 ? 0.0 : problem_.cameras[first].position_m.z();
    ceres_.AddResidualBlock(automatic<HeightResidual, 1, 6>({up_m}), nullptr, cameras_[first].data());
  }

  /// By the cameras on either side, as far as they are of the same session and known.
  void addTravel(std::size_t i) {
    BundleSession& session = problem_.sessions[sessions_[i]];
    const RobotAttitude robot(problem_.cameras[i].rotation, session.mounting);
    double* correction = session.mounting_rad.data();
    ceres_.AddResidualBlock(automatic<LeanResidual, 1, 6, 3>({robot, config_.tilt_sigma_rad.z()}), &tilt_loss_,
                            cameras_[i].data(), correction);
    const auto is_beside = [&](std::size_t other) {
      return other < cameras_.size() && sessions_[other] == sessions_[i] && window_.knows(other);
    };
    if (i == 0 || !is_beside(i - 1) || !is_beside(i + 1)) return;
    const std::optional<TravelResidual> travel = travelOf(problem_, config_, i);
    if (!travel) return;
    ceres_.AddResidualBlock(automatic<TravelResidual, 2, 6, 6, 6, 3>(*travel), &tilt_loss_, cameras_[i].data(),
                            cameras_[i - 1].data(), cameras_[i + 1].data(), correction);
  }

  /// From a camera to the next one.
  void addSlope(std::size_t i) {
    if (!(window_.moves(i) || window_.moves(i + 1)) || !(window_.knows(i) && window_.knows(i + 1))) return;
    ceres_.AddResidualBlock(automatic<SlopeResidual, 1, 6, 6>(slopeOf(problem_, config_, i)), nullptr,
                            cameras_[i].data(), cameras_[i + 1].data());
  }

  void holdOthers() {
    for (std::size_t i = 0; i < cameras_.size(); ++i) {
      double* camera = cameras_[i].data();
      if (!window_.moves(i) && ceres_.HasParameterBlock(camera)) ceres_.SetParameterBlockConstant(camera);
    }
  }

  /// Landmarks first. Left to itself Ceres eliminates the mounting as well, which ties every camera to every other.
  /// Within a group Ceres goes by address, so a group is of one array, or the result would depend on where memory is.
  /// One thread: more add up in the order in which they end, and two are no faster.
  ceres::Solver::Options solverOptions() {
    ceres::Solver::Options options;
    options.linear_solver_type = ceres::SPARSE_SCHUR;
    options.max_num_iterations = config_.max_iterations;
    options.logging_type = ceres::SILENT;
    options.function_tolerance = config_.tolerance;
    options.use_nonmonotonic_steps = true;  // along a flat valley it takes a third fewer
    options.linear_solver_ordering = std::make_shared<ceres::ParameterBlockOrdering>();
    const auto add = [&](double* block, int group) {
      if (ceres_.HasParameterBlock(block)) options.linear_solver_ordering->AddElementToGroup(block, group);
    };
    for (double* landmark : landmarks_) add(landmark, 0);
    for (auto& camera : cameras_) add(camera.data(), 1);
    for (BundleSession& session : problem_.sessions) {
      add(session.mounting_rad.data(), 2);
      add(session.fix_bias_m.data(), 3);
      add(&session.fix_delay_s, 4);
      add(&session.fix_height_m, 5);
    }
    for (BundleLens& lens : problem_.lenses) add(lens.correction.data(), 6);
    return options;
  }

  BundleProblem& problem_;
  const BundleConfig& config_;
  const BundleWindow& window_;
  ceres::CauchyLoss sighting_loss_;
  ceres::CauchyLoss tilt_loss_;
  ceres::CauchyLoss position_loss_;
  GemanMcClureLoss doubtful_position_loss_;
  ceres::CauchyLoss altitude_loss_;
  std::vector<std::size_t> sessions_;  ///< of the cameras
  std::vector<Eigen::Matrix3d> starts_;
  std::vector<std::array<double, 6>> cameras_;  ///< as in SightingCost
  std::vector<double*> landmarks_;              ///< those that are seen
  ceres::Problem ceres_;
};

}  // namespace

double adjust(BundleProblem& problem, const BundleConfig& config, const BundleWindow& window) {
  return Adjustment(problem, config, window).solve();
}

SharedSigmas sharedSigmas(BundleProblem problem, const BundleConfig& config, const BundleWindow& window) {
  Adjustment adjustment(problem, config, window);
  std::vector<std::pair<double*, int>> blocks{{problem.lenses.front().correction.data(), 6},
                                              {&problem.sessions.front().fix_delay_s, 1}};
  const std::vector<std::pair<double*, int>> cameras = adjustment.someCameras();
  blocks.insert(blocks.end(), cameras.begin(), cameras.end());
  const std::vector<double> sigmas = adjustment.sigmasOf(blocks);
  SharedSigmas shared;
  if (sigmas.empty()) return shared;
  shared.lens = Eigen::Map<const LensCorrection>(sigmas.data());
  shared.fix_delay_s = sigmas[6];
  std::vector<double> horizontal_m;
  for (std::size_t i = 7; i < sigmas.size(); i += 6) {
    horizontal_m.push_back(std::sqrt(0.5) * std::hypot(sigmas[i + 3], sigmas[i + 4]));
  }
  shared.position_m = median(std::move(horizontal_m));
  return shared;
}

const BundleSession& BundleProblem::sessionOf(std::size_t camera) const {
  const auto after =
      std::upper_bound(sessions.begin(), sessions.end(), camera,
                       [](std::size_t image, const BundleSession& session) { return image < session.begin; });
  return *std::prev(after);
}

LensProjection BundleProblem::lensOf(std::size_t camera) const {
  const BundleLens& lens = lenses[sessionOf(camera).lens];
  return {lens.published, lens.correction};
}

double reprojectionError_px(const BundleProblem& problem, const Landmark& landmark, const LandmarkSighting& sighting) {
  const Eigen::Vector3d point = problem.cameras[sighting.image].toCamera(landmark.position_m);
  if (!(point.z() >= kNearest_m)) return std::numeric_limits<double>::infinity();
  return (problem.lensOf(sighting.image).project(point.hnormalized()) - sighting.pixel).norm();
}

Eigen::Matrix3d covarianceOf(const Landmark& landmark, const BundleProblem& problem) {
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
  for (const LandmarkSighting& sighting : landmark.sightings) {
    const CameraPose& camera = problem.cameras[sighting.image];
    const Eigen::Vector3d point = camera.toCamera(landmark.position_m);
    Eigen::Matrix<double, 2, 3> ray_by_point;
    ray_by_point << 1.0, 0.0, -point.x() / point.z(), 0.0, 1.0, -point.y() / point.z();
    ray_by_point *= 1.0 / (point.z() * sighting.sigma_px);
    Eigen::Matrix2d by_ray;
    problem.lensOf(sighting.image).project(point.hnormalized(), &by_ray);
    const Eigen::Matrix<double, 2, 3> by_landmark =
        by_ray * ray_by_point * camera.rotation.conjugate().toRotationMatrix();
    information += by_landmark.transpose() * by_landmark;
  }
  return information.ldlt().solve(Eigen::Matrix3d::Identity());
}

void addSighting(const Landmark& landmark, const Eigen::Matrix3d& covariance, std::uint32_t feature, std::uint32_t id,
                 ImageGeometry& image) {
  const Eigen::Vector3d offset = landmark.position_m - image.camera.position_m;
  const Eigen::Vector3d ray = offset.normalized();
  const double along_m2 = ray.dot(covariance * ray);
  const double across_m2 = 0.5 * (covariance.trace() - along_m2);
  if (!(std::isfinite(along_m2) && along_m2 > 0.0 && across_m2 > 0.0)) return;
  image.landmarks.push_back({feature, id, offset.cast<float>(), static_cast<float>(std::sqrt(along_m2)),
                             static_cast<float>(std::sqrt(across_m2))});
}

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
    ceres::Solver::Options options;
    options.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
    options.logging_type = ceres::SILENT;
    ceres::Solver::Summary summary;
    const QuietCeres quiet;
    ceres::Solve(options, &ceres_, &summary);
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
