#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include <Eigen/Core>

#include "evaluation/run.h"

namespace visual_localization {

/// A Kalman filter for positions in the plane, with constant velocity and white acceleration: what a user would put
/// behind the localizer. It takes the errors of successive positions for independent.
class VelocityFilter {
 public:
  /// A position at its time: metres, covariance of east and north. Begins anew after a pause, when time goes back, and
  /// with a position that is no continuation of the ones before.
  void add(std::int64_t stamp_ns, const Eigen::Vector2d& position_m, const Eigen::Matrix2d& covariance_m2);

  // Of the last position added, which there must be.
  Eigen::Vector2d position_m() const { return state_.head<2>(); }
  Eigen::Matrix2d covariance_m2() const { return covariance_.topLeftCorner<2, 2>(); }

 private:
  void begin(const Eigen::Vector2d& position_m, const Eigen::Matrix2d& covariance_m2);
  void predict(double elapsed_s);

  std::optional<std::int64_t> stamp_ns_;
  Eigen::Vector4d state_ = Eigen::Vector4d::Zero();  ///< position, velocity (m/s)
  Eigen::Matrix4d covariance_ = Eigen::Matrix4d::Zero();
};

/// Writes into `step` how far heading and claims of an estimate are from the truth (map frame), and what of that is not
/// the map's own error. `map_error`: none when it is not known.
void judgePose(const Estimate& estimate, const Eigen::Vector2d& truth_m, const std::optional<double>& true_yaw_rad,
               const std::optional<MapError>& map_error, StepRecord& step);

/// What the filter makes of a METRIC pose while TRACKING; of other estimates nothing.
void judgeFiltered(const Estimate& estimate, const Eigen::Vector2d& truth_m, const std::optional<MapError>& map_error,
                   VelocityFilter& filter, StepRecord& step);

/// One step as a line of a TUM trajectory: "stamp tx ty tz qx qy qz qw", x ahead, y left, z up in the map frame. Level
/// and at height 0 but for poses solved from landmarks.
std::string tumLine(const Estimate& estimate);
/// The same of a true pose. A heading that is not known is 0.
std::string tumLine(std::int64_t stamp_ns, const Eigen::Vector2d& position_m, double yaw_rad);

}  // namespace visual_localization
