#include "visual_localization/localization/motion.h"

#include <Eigen/Geometry>

#include "visual_localization/localization/particles.h"

namespace visual_localization {

Motion::Motion(double seconds, const std::optional<OdometryIncrement>& odometry, const OdometryConfig& config)
    : seconds_(seconds) {
  if (!odometry) return;
  increment_ = *odometry;
  sigma_m_ = config.distance_sigma * odometry->distance_m;
  share_ = config.share;
}

bool Motion::carries(Random& random) const { return share_ > 0.0 && random.uniform(0.0, 1.0) < share_; }

Eigen::Vector2d Motion::displacementAt(const TrainingMap& map, const Eigen::Vector2d& position_m) const {
  if (increment_.translation_m.isZero(0.0)) return Eigen::Vector2d::Zero();
  return Eigen::Rotation2Dd(map.yaw_rad(map.nearest(position_m).image)) * increment_.translation_m;
}

}  // namespace visual_localization
