#pragma once

#include <cstdint>
#include <optional>

#include <Eigen/Core>

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

}  // namespace visual_localization
