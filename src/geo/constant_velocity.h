#pragma once

#include <algorithm>
#include <cmath>

#include <Eigen/Core>

namespace visual_localization {

/// A measured position of a path.
struct PathSample {
  double time_s = 0.0;                                   ///< since any fixed moment
  Eigen::Vector2d position_m = Eigen::Vector2d::Zero();  ///< east, north
};

/// Position and velocity in the plane with white acceleration (Bar-Shalom et al., Estimation with Applications to
/// Tracking and Navigation, 6.2.2). Both axes share one covariance.
struct ConstantVelocity {
  Eigen::Vector2d position_m = Eigen::Vector2d::Zero();
  Eigen::Vector2d velocity_mps = Eigen::Vector2d::Zero();
  double position_var = 0.0;  ///< m^2
  double covariance = 0.0;    ///< of position and velocity, m^2/s
  double velocity_var = 0.0;  ///< m^2/s^2

  /// Nothing is known of the velocity but how large it usually is.
  static ConstantVelocity startAt(const Eigen::Vector2d& position_m, double sigma_m, double usual_mps) {
    return {position_m, Eigen::Vector2d::Zero(), sigma_m * sigma_m, 0.0, usual_mps * usual_mps};
  }

  /// `density`: of the acceleration, m^2/s^3.
  void predict(double elapsed_s, double density) {
    position_m += elapsed_s * velocity_mps;
    position_var += elapsed_s * (2.0 * covariance + elapsed_s * (velocity_var + density * elapsed_s / 3.0));
    covariance += elapsed_s * (velocity_var + 0.5 * density * elapsed_s);
    velocity_var += density * elapsed_s;
  }

  void update(const Eigen::Vector2d& measured_m, double variance) {
    const double total = position_var + variance;
    const Eigen::Vector2d innovation_m = measured_m - position_m;
    position_m += position_var / total * innovation_m;
    velocity_mps += covariance / total * innovation_m;
    velocity_var -= covariance * covariance / total;
    covariance *= variance / total;
    position_var *= variance / total;
  }

  /// The receiver's error changes at once; the velocity is kept.
  void stepTo(const Eigen::Vector2d& measured_m, double variance) {
    position_m = measured_m;
    position_var = variance;
    covariance = 0.0;
  }

  double logDeterminant() const {
    constexpr double kLeast = 1e-30;  // rounding may leave less than nothing
    return std::log(std::max(kLeast, position_var * velocity_var - covariance * covariance));
  }
};

}  // namespace visual_localization
