#pragma once

#include <string>

namespace visual_localization {

/// How far the positions of a session may be off by errors of its receiver that last, and from what that follows. All
/// per horizontal axis.
struct FixBudget {
  double declared_m = 0.0;     ///< one sigma of a usual fix, as the receiver claims it
  bool assumed = false;        ///< it claims nothing: geometry/fix_sigma, or that of a usual receiver
  double residual_m = 0.0;     ///< root mean square of the believed fixes' distances from the path
  double correlation_s = 0.0;  ///< integral of the autocorrelation of these distances
  double duration_s = 0.0;     ///< for which there are fixes
  double sigma_m = 0.0;        ///< of the session's positions
};

/// For people: "0.42 m per axis: fixes claim 0.85 m, and 0.71 m of that show beside the path, ...".
std::string describe(const FixBudget& budget);

}  // namespace visual_localization
