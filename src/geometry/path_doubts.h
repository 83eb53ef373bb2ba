#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "visual_localization/geometry/fix_budget.h"

namespace visual_localization {

/// An image on the adjusted path of its session, and what speaks for its being there.
struct PathEvidence {
  std::int64_t stamp_ns = 0;
  Eigen::Vector2d position_m = Eigen::Vector2d::Zero();
  /// Of the believed fixes around it from this path, the median; nothing without any.
  std::optional<Eigen::Vector2d> off_fixes_m = {};
  double fix_sigma_m = 0.0;  ///< of one of them, per axis, as claimed
  /// By how much more than on the path the images turn to the left, from the images before to this one; nothing where
  /// no image before shows the same.
  std::optional<double> turned_rad = {};
};

/// What the test of a path leaves open, per horizontal axis.
struct PathDoubt {
  double by_fixes_m = 0.0;  ///< from where fixes and path agree, or as far as they disagree
  double by_turns_m = 0.0;  ///< how far another path is that turns as the images do
  bool fails = false;       ///< one of the tests here, not only farther along the path
  double m() const;
};

/// Metres that images stray in a metre without fixes, one sigma.
constexpr double kDrift = 0.04;

/// One test for all that may be wrong with a recording: clocks, receivers, lenses, the order of images. The fixes
/// around an image must lie where the adjusted path has it, within three sigmas of theirs and of the path's,
/// `path_sigma_m`; and the path must turn as the images do. Where it fails the doubt grows to what was found; what is
/// not confirmed is in doubt by the way to what is. `path`: of one session, in order of time.
std::vector<PathDoubt> doubtsOf(const std::vector<PathEvidence>& path, double path_sigma_m);

/// The images that fail, with those between them that are a few metres long. `sigmas_m`: what their positions are good
/// to in the end.
std::vector<DoubtfulStretch> doubtfulStretches(const std::vector<PathEvidence>& path,
                                               const std::vector<PathDoubt>& doubts,
                                               const std::vector<double>& sigmas_m);

}  // namespace visual_localization
