#pragma once

#include <vector>

#include "geo/constant_velocity.h"

namespace visual_localization {

/// -log of Student's t in the plane, but for its constant and its scale, in nats. `squared`: distance in squared
/// sigmas.
double studentCost(double squared);
/// The weight that Student's t leaves to something so far away: 1 near its middle.
double studentWeight(double squared);

/// Median of a distance in the plane, in sigmas along one axis.
constexpr double kMedianOfPlane = 1.1774;
/// Speeds are measured over about this.
constexpr double kSpeedLag_s = 4.0;

/// How a recording's robot moves and how its receiver errs, learnt from the recording itself.
struct MotionScales {
  double acceleration_density = 0.0;  ///< m^2/s^3
  double noise_m = 0.0;               ///< white, of a node along one axis
  double usual_mps = 0.0;             ///< while it moves
  double log_variance = 0.0;          ///< logarithm of the usual variance of an innovation
  std::vector<double> tolerance;      ///< of each node: factor of its innovation's variance
  std::vector<double> mean_cost;      ///< of each node: that of believing those around it, nats
};

/// Maximum likelihood of the innovations of a constant-velocity filter over acceleration density and noise (Student's
/// t, so that outliers decide little). Standing or cruising for most of the time would then make bends improbable: the
/// density is enlarged until the moving nodes fit. `nodes`: in order of time, at least one. `believed`: those to learn
/// from; empty: all. `least_density`: of the acceleration. `steps`: nodes before which the receiver's error changes at
/// once, which is no motion; empty: none. `least_noise_m`: what the receiver rounds to leaves so much.
MotionScales learnScales(const std::vector<PathSample>& nodes, const std::vector<bool>& believed, double least_density,
                         const std::vector<bool>& steps = {}, double least_noise_m = 0.0);

}  // namespace visual_localization
