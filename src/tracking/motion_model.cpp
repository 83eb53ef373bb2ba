#include "visual_localization/tracking/motion_model.h"

#include <cmath>

#include <Eigen/Geometry>

#include "visual_localization/geo/angles.h"

namespace visual_localization {

void GaussianMotion::start(Particle& particle, Random&) const { particle.velocity_m.setZero(); }

void GaussianMotion::move(Particle& particle, Random& random) const {
  particle.position_m += random.normal(Eigen::Vector2d(std_m_, std_m_));
}

void LinearMotion::start(Particle& particle, Random& random) const {
  const double direction_rad = random.uniform(-kPi, kPi);
  particle.velocity_m = initial_speed_m_ * Eigen::Vector2d(std::cos(direction_rad), std::sin(direction_rad));
}

/// Kronfeld et al. (journal), Eq. 7 and 8: the velocity is rotated, then scaled.
void LinearMotion::move(Particle& particle, Random& random) const {
  const Eigen::Rotation2Dd rotation(random.normal(rotation_std_rad_));
  particle.velocity_m = std::exp(random.normal(acceleration_std_)) * (rotation * particle.velocity_m);
  particle.position_m += particle.velocity_m;
}

}  // namespace visual_localization
