#pragma once

#include <cstdint>
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

/// Images of a session, one after the other, where its fixes, its path and what the images see do not fit together.
struct DoubtfulStretch {
  std::int64_t from_ns = 0;  ///< stamps of the first and the last image
  std::int64_t to_ns = 0;
  double from_m = 0.0;  ///< where they are along the path of the session
  double to_m = 0.0;
  double sigma_m = 0.0;      ///< the largest expected error of their positions, per horizontal axis
  double off_fixes_m = 0.0;  ///< so far beside the path lie the fixes around one of them
  double off_turns_m = 0.0;  ///< so far from it leads, per axis, a path that turns as the images do; 0: it fits
};

/// For people: "12 to 45 m (1275387630.500 to 1275387690.000 s): off by up to 20.0 m per axis (one sigma), since ...".
std::string describe(const DoubtfulStretch& stretch);

}  // namespace visual_localization
