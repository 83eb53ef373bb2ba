#pragma once

#include <cstddef>
#include <vector>

#include <Eigen/Core>

#include "geometry/session_geometry.h"
#include "visual_localization/geo/trajectory.h"
#include "visual_localization/geometry/fix_budget.h"

namespace visual_localization {

/// A fix beside the path.
struct FixResidual {
  double time_s = 0.0;
  Eigen::Vector2d off_m = Eigen::Vector2d::Zero();
  double sigma_m = 1.0;  ///< of the fix, per axis
};

/// What a receiver promises and its fixes do not show about the path lies in the path: a slow error bends it with
/// itself. sigma^2 = max(0, declared^2 - residual^2) + residual^2 correlation / duration: the second part is the error
/// of a mean over correlated residuals. No correlation time of the receiver is assumed. Never below `adjusted_m`, what
/// an adjustment of the path leaves open. On top comes what is alike from one second to the next beyond the claim: the
/// path is bent, or the receiver claims too little. `residuals`: in order of time.
FixBudget fixBudget(const std::vector<FixResidual>& residuals, double adjusted_m = 0.0);
/// Of a path that was cleaned, but not adjusted.
FixBudget fixBudget(const Trajectory& path, const std::vector<MapFix>& fixes, const GeometryConfig& config);

/// What a fix that claims no sigma counts for: geometry/fix_sigma, if somebody knows it.
double sigmaOfUndeclared_m(const GeometryConfig& config);
/// Of fixes most of which claim no sigma, unless somebody knows it: what they show, and no better than such receivers
/// are. A slow error of some metres shows in no recording.
FixBudget withoutClaims(FixBudget budget, const std::vector<MapFix>& fixes, const GeometryConfig& config);

/// How long a receiver errs alike: of a Gauss-Markov process whose mean over the session has the share of the declared
/// variance that the budget leaves. At most an hour, since satellites move on.
double receiverCorrelation_s(const FixBudget& budget);

/// A session among those that share a path.
struct TiedBudget {
  FixBudget budget;
  Eigen::Vector2d offset_m = Eigen::Vector2d::Zero();  ///< of its fixes from the common path, on average
  double begin_s = 0.0;                                ///< of the recording
  double end_s = 0.0;
};

/// What sessions know of their common path.
struct CommonBudget {
  std::vector<std::size_t> receivers;  ///< of each session: those that err alike have the same number
  /// Of the sigmas of the sessions, by how far their offsets lie apart: their receivers promised too much or too
  /// little.
  double stretch = 1.0;
};

/// Sessions that follow each other within a receiver's correlation time count as one, with the smallest sigma of them.
/// The prior weighs as much as four of the 2 (K - 1) offsets of K receivers.
CommonBudget commonBudget(const std::vector<TiedBudget>& sessions);

}  // namespace visual_localization
