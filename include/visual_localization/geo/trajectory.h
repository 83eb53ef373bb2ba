#pragma once

#include <cstdint>
#include <limits>
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
  /// Points must be finite and in strictly increasing order of stamp; throws std::invalid_argument otherwise.
  /// Nothing is known between points that are more than `max_gap_s` apart.
  explicit Trajectory(std::vector<TrajectoryPoint> points, double max_gap_s = std::numeric_limits<double>::infinity());

  /// Linear interpolation (yaw along the shorter arc); nothing outside the recorded time or inside a gap.
  std::optional<TrajectoryPoint> at(std::int64_t stamp_ns) const;

  const std::vector<TrajectoryPoint>& points() const { return points_; }
  /// Length of the path in metres, gaps not counted.
  double length() const;

 private:
  bool isGap(const TrajectoryPoint& before, const TrajectoryPoint& after) const;

  std::vector<TrajectoryPoint> points_;
  double max_gap_s_ = std::numeric_limits<double>::infinity();
};

}  // namespace visual_localization
