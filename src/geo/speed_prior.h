#pragma once

#include <vector>

#include "geo/constant_velocity.h"
#include "geo/motion_scales.h"

namespace visual_localization {

/// What a recording's own speeds say about one. Of a robot that drives at constant speed: how far off it is; of others
/// their density, by a Gaussian kernel.
class SpeedPrior {
 public:
  /// `tolerance`: standard deviation of a constant speed, as a share of it; 0: the nodes say whether it is constant,
  /// and how well, unless it is known that it varies.
  SpeedPrior(const std::vector<PathSample>& nodes, const MotionScales& scales, double tolerance, bool varies = false);

  bool isConstant() const { return constant_mps_ > 0.0; }
  /// 0: it varies.
  double constant_mps() const { return constant_mps_; }
  /// In nats. Usual speeds cost nothing.
  double cost(double speed_mps) const;

 private:
  void learnDensity(const std::vector<double>& speeds_mps, double noise_mps);

  double standing_mps_ = 0.0;  ///< up to this it may as well stand
  double constant_mps_ = 0.0;  ///< 0: it varies
  double sigma_mps_ = 0.0;
  double most_for_slow_ = 0.0;
  double bin_mps_ = 1.0;
  std::vector<double> costs_;  ///< by bins of speed; empty: too few to tell
};

}  // namespace visual_localization
