#pragma once

#include <cstdint>
#include <deque>
#include <optional>

#include <Eigen/Core>

#include "visual_localization/parameters/parameters.h"

namespace visual_localization {

/// How far odometry is believed.
struct OdometryConfig {
  double max_speed_mps = 10.0;  ///< a faster reading has jumped; no parameter
  double max_gap_s = 0.5;       ///< between two readings; no parameter
  double distance_sigma = 0.05;
  double turn_sigma_rad_m = 0.01;
  double max_distance_m = 100.0;  ///< that it bridges, which is 5 m of sigma by then; no parameter
  double share = 0.5;             ///< of the particles; the others find out if it is wrong; no parameter

  void declare(ParameterVisitor& visitor);
};

/// Where odometry has the robot, in a frame of its own that drifts.
struct OdometryReading {
  std::int64_t stamp_ns = 0;
  Eigen::Vector2d position_m = Eigen::Vector2d::Zero();
  double yaw_rad = 0.0;
};

/// What odometry says about the way from one time to another, in the robot's frame at the first.
struct OdometryIncrement {
  Eigen::Vector2d translation_m = Eigen::Vector2d::Zero();  ///< forward, left
  double rotation_rad = 0.0;                                ///< counter-clockwise
  double distance_m = 0.0;                                  ///< along the way
};

/// The last readings of odometry.
class OdometryTrack {
 public:
  explicit OdometryTrack(const OdometryConfig& config) : config_(config) {}

  void configure(const OdometryConfig& config) { config_ = config; }
  /// Readings must come in order of time: a late one is ignored, and where time goes back by more than kLate_s all
  /// begins anew. Throws std::invalid_argument when a number is not finite, and then nothing has changed.
  void add(const OdometryReading& reading);
  /// Nothing unless readings cover the time, without a gap (max_gap_s) or a jump (max_speed_mps, or a turn faster than
  /// 2 pi/s), from the first of them on. Up to max_gap_s after the last one the motion goes on.
  std::optional<OdometryIncrement> between(std::int64_t from_ns, std::int64_t to_ns) const;

  static constexpr double kLate_s = 1.0;

 private:
  struct Point {
    OdometryReading at;
    double way_m = 0.0;   ///< since the first reading
    bool joined = false;  ///< to the one before
  };

  std::optional<Point> pointAt(std::int64_t stamp_ns) const;

  OdometryConfig config_;
  std::deque<Point> points_;
};

}  // namespace visual_localization
