#pragma once

#include <cstddef>
#include <limits>
#include <vector>

#include <Eigen/Core>

#include "geometry/bundle_problem.h"
#include "geometry/lens_correction.h"

namespace visual_localization {

struct BundleConfig {
  double landmark_loss = 2.5;  ///< scale of the Cauchy loss of an observation, sigmas
  double position_loss = 1.0;  ///< scale of the loss of a fix, sigmas: Cauchy's if believed, else Geman and McClure's
  Eigen::Vector3d tilt_sigma_rad{0.02, 0.1, 0.02};  ///< of a robot about its direction of travel: pitch, yaw, roll
  double slope_sigma = 0.1;                         ///< rise over run
  int max_iterations = 50;
  double tolerance = 1e-4;  ///< relative change of the cost at which it ends
  /// One sigma of each entry of a calibration; zero: all calibrations stay as they are.
  LensCorrection lens_sigma = LensCorrection::Zero();
};

/// Cameras that are adjusted together. Those that are known and do not move stand still; what others saw does not
/// count. All of them unless said otherwise.
struct BundleWindow {
  static constexpr std::size_t kAll = std::numeric_limits<std::size_t>::max();

  const std::vector<std::size_t>* ranks = nullptr;  ///< of the cameras, which the limits are about; none: their indices
  std::size_t begin = 0;                            ///< the first camera that moves
  std::size_t end = kAll;                           ///< the one behind the last that moves
  std::size_t known_begin = 0;
  std::size_t known_end = kAll;

  std::size_t rank(std::size_t camera) const { return ranks != nullptr ? (*ranks)[camera] : camera; }
  bool moves(std::size_t camera) const { return rank(camera) >= begin && rank(camera) < end; }
  bool knows(std::size_t camera) const { return rank(camera) >= known_begin && rank(camera) < known_end; }
};

/// Moves the cameras of the window, the landmarks that they see, mountings, biases and delays of their sessions, and
/// their lenses where these are free, to where all observations agree best. Returns the final cost.
double adjust(BundleProblem& problem, const BundleConfig& config, const BundleWindow& window = {});

/// Turns, scales and shifts a single session as a whole, and turns its mounting, to where fixes, altitudes, slopes and
/// level robots agree best. What images see of each other does not change, and an adjustment of all of them hardly
/// feels it: it would need hundreds of iterations. Nothing without a believed fix.
void moveAsOne(BundleProblem& problem, const BundleConfig& config);

/// What an adjustment does not tell by its result: standard deviations of what the images of a session share.
struct SharedSigmas {
  LensCorrection lens = LensCorrection::Zero();  ///< of the first lens
  double fix_delay_s = 0.0;                      ///< of the first session
  double position_m = 0.0;                       ///< of a camera that moves, per horizontal axis; of some the median
};
/// Of an adjusted problem, by the curvature of its cost there. Zero where nothing depends on it.
SharedSigmas sharedSigmas(BundleProblem problem, const BundleConfig& config, const BundleWindow& window = {});

}  // namespace visual_localization
