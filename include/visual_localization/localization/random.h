#pragma once

#include <cstdint>
#include <random>

#include <Eigen/Core>

namespace visual_localization {

/// The one source of randomness of a tracker: seeded, passed in, never global.
class Random {
 public:
  explicit Random(std::uint32_t seed) : engine_(seed) {}

  /// Uniform in [min, max).
  double uniform(double min, double max) { return std::uniform_real_distribution<double>(min, max)(engine_); }
  /// N(0, std_dev^2).
  double normal(double std_dev) { return std::normal_distribution<double>(0.0, 1.0)(engine_) * std_dev; }
  /// Independent N(0, std_dev_i^2) per axis.
  Eigen::Vector2d normal(const Eigen::Vector2d& std_dev) {
    const double x = normal(std_dev.x());
    return {x, normal(std_dev.y())};
  }

 private:
  std::mt19937 engine_;
};

}  // namespace visual_localization
