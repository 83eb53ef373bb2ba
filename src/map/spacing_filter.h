#pragma once

#include <limits>

#include <Eigen/Core>

namespace visual_localization {

/// Leaves out positions of a path that are closer to the last one it kept than a distance.
class SpacingFilter {
 public:
  explicit SpacingFilter(double spacing_m) : spacing_m_(spacing_m) {}

  bool keeps(const Eigen::Vector2d& position_m) {
    if ((position_m - last_m_).norm() < spacing_m_) return false;
    last_m_ = position_m;
    return true;
  }

 private:
  double spacing_m_;
  Eigen::Vector2d last_m_ = Eigen::Vector2d::Constant(std::numeric_limits<double>::infinity());  ///< none yet
};

}  // namespace visual_localization
