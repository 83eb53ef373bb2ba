#include "localization/motion_model.h"

#include <cmath>
#include <utility>

#include <Eigen/Geometry>

#include "base/numbers.h"

namespace visual_localization {

void GaussianMotion::move(Particle& particle, const Travel&, Random& random) const {
  particle.position_m += random.normal(Eigen::Vector2d(std_m_, std_m_));
}

void LinearMotion::start(Particle& particle, Random& random) const {
  const double direction_rad = random.uniform(-kPi, kPi);
  particle.velocity_m = initial_speed_m_ * Eigen::Vector2d(std::cos(direction_rad), std::sin(direction_rad));
}

/// Kronfeld et al. (journal), Eq. 7 and 8: the velocity is rotated, then scaled.
void LinearMotion::move(Particle& particle, const Travel&, Random& random) const {
  const Eigen::Rotation2Dd rotation(random.normal(rotation_std_rad_));
  particle.velocity_m = std::exp(random.normal(acceleration_std_)) * (rotation * particle.velocity_m);
  particle.position_m += particle.velocity_m;
}

Eigen::Vector2d wayInMap(const TrainingMap& map, const Eigen::Vector2d& position_m, const OdometryIncrement& odometry) {
  return Eigen::Rotation2Dd(map.yaw_rad(map.nearest(position_m).image)) * odometry.translation_m;
}

void OdometryMotion::move(Particle& particle, const Travel& travel, Random& random) const {
  if (!travel.odometry || random.uniform(0.0, 1.0) >= config_.share) {
    return otherwise_->move(particle, travel, random);
  }
  constexpr double kLeast_m = 0.2;  // particles are as far apart as the training images allow
  const double sigma_m = kLeast_m + config_.distance_sigma * travel.odometry->distance_m;
  particle.position_m +=
      wayInMap(map_, particle.position_m, *travel.odometry) + random.normal(Eigen::Vector2d(sigma_m, sigma_m));
}

void PullToMap::move(Particle& particle, const Travel&, Random&) const {
  const Eigen::Vector2d target_m = map_.position_m(map_.nearest(particle.position_m).image);
  particle.position_m += share_ * (target_m - particle.position_m);
}

CombinedMotion::CombinedMotion(std::vector<std::unique_ptr<MotionModel>> parts) : parts_(std::move(parts)) {}

void CombinedMotion::start(Particle& particle, Random& random) const {
  for (const auto& part : parts_) part->start(particle, random);
}

void CombinedMotion::move(Particle& particle, const Travel& travel, Random& random) const {
  for (const auto& part : parts_) part->move(particle, travel, random);
}

}  // namespace visual_localization
