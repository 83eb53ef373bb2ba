#include "geometry/bundle_adjustment.h"

#include <algorithm>
#include <array>
#include <cmath>
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
#include "geometry/quiet_ceres.h"
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
        observation_loss_(config.landmark_loss),
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
    addObservations();
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

  /// Parameters of some of the cameras that move, evenly spread.
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
    for (const LandmarkObservation& observation : landmark.observations) {
      known += window_.knows(observation.image) ? 1 : 0;
      moves = moves || window_.moves(observation.image);
    }
    return moves && known >= 2;
  }

  void addObservations() {
    for (Landmark& landmark : problem_.landmarks) {
      if (!isSeen(landmark)) continue;
      landmarks_.push_back(landmark.position_m.data());
      for (const LandmarkObservation& observation : landmark.observations) {
        if (!window_.knows(observation.image)) continue;
        BundleLens& lens = problem_.lenses[problem_.sessions[sessions_[observation.image]].lens];
        ceres_.AddResidualBlock(new ReprojectionCost(starts_[observation.image], observation, lens.published),
                                &observation_loss_, cameras_[observation.image].data(), landmark.position_m.data(),
                                lens.correction.data());
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
    options.max_num_consecutive_invalid_steps = 20;  // each damps more; one too many and the whole adjustment is lost
    options.use_nonmonotonic_steps = true;           // along a flat valley it takes a third fewer
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
  ceres::CauchyLoss observation_loss_;
  ceres::CauchyLoss tilt_loss_;
  ceres::CauchyLoss position_loss_;
  GemanMcClureLoss doubtful_position_loss_;
  ceres::CauchyLoss altitude_loss_;
  std::vector<std::size_t> sessions_;  ///< of the cameras
  std::vector<Eigen::Matrix3d> starts_;
  std::vector<std::array<double, 6>> cameras_;  ///< as in ReprojectionCost
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

}  // namespace visual_localization
