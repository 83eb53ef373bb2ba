#pragma once

#include <vector>

#include "geo/constant_velocity.h"

namespace visual_localization {

/// A position as a receiver measured it.
struct Measurement {
  PathSample sample;
  double white_m = 1.0;   ///< error along one axis that differs from one measurement to the next
  double offset_m = 1.0;  ///< and one that lasts
  bool steps = false;     ///< the lasting error has nothing to do with the one before
  /// Nobody believes it: beside the other errors it has one that it shares with those that follow it, as long as they
  /// are aside as well. Where the path is not known otherwise they are as good as their own distance from it.
  bool aside = false;
};

/// By such a ratio of what it promises a receiver's error is another one.
constexpr double kOtherPromise = 5.0;

/// How a robot moves.
struct Motion {
  double acceleration_density = 0.0;  ///< m^2/s^3
  double usual_mps = 0.0;             ///< while it moves
};

/// State of a path at a measurement. Variances are along one axis.
struct PathState {
  double time_s = 0.0;
  Eigen::Vector2d position_m = Eigen::Vector2d::Zero();
  Eigen::Vector2d velocity_mps = Eigen::Vector2d::Zero();
  Eigen::Vector2d offset_m = Eigen::Vector2d::Zero();  ///< the receiver's error here, but for white noise
  double position_var = 0.0;                           ///< m^2
  double velocity_var = 0.0;                           ///< m^2/s^2
  double reading_var = 0.0;                            ///< of position and offset together, m^2
};

/// Fixed-interval smoother (Rauch, Tung, Striebel) over position, velocity, an error of the receiver that lasts and one
/// of measurements that are aside; the acceleration is white. The lasting error is another one behind a step, and where
/// the receiver comes to promise much more or less. Steps of one that promises alike throughout count only where it
/// has one error most of the time or comes back to it: otherwise nothing tells which of its errors are aside.
/// `measurements`: at least one, in strictly increasing order of time.
std::vector<PathState> smoothPath(std::vector<Measurement> measurements, const Motion& motion);

/// Between two states the path of least acceleration; where the way is much shorter than their velocities ask for, it
/// does not swing.
PathState between(const PathState& before, const PathState& after, double time_s);

/// What a receiver without white noise would read when it read `seen`, in reach of the path or beyond its ends. At a
/// step, by the lasting error that is nearer to it.
struct Reading {
  Eigen::Vector2d position_m = Eigen::Vector2d::Zero();
  double variance = 0.0;  ///< along one axis, m^2
};
Reading readingAt(const std::vector<PathState>& path, const Motion& motion, const PathSample& seen);

}  // namespace visual_localization
