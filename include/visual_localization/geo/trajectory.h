#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include <Eigen/Core>

namespace visual_localization {

/// Where the robot was and where it was heading.
struct TrajectoryPoint {
  std::int64_t stamp_ns = 0;
  Eigen::Vector2d position_m = Eigen::Vector2d::Zero();  ///< east, north in the local frame
  double yaw_rad = 0.0;                                  ///< direction of travel, 0 = east, counter-clockwise
};

/// A driven path as a function of time.
class Trajectory {
 public:
  Trajectory() = default;
  /// Points must be in strictly increasing order of stamp; throws std::invalid_argument otherwise.
  explicit Trajectory(std::vector<TrajectoryPoint> points);

  /// Linear interpolation (yaw along the shorter arc); nothing outside the recorded time.
  std::optional<TrajectoryPoint> at(std::int64_t stamp_ns) const;

  const std::vector<TrajectoryPoint>& points() const { return points_; }
  /// Length of the path in metres.
  double length() const;

 private:
  std::vector<TrajectoryPoint> points_;
};

}  // namespace visual_localization
