#include "visual_localization/tracking/cloud.h"

#include <algorithm>
#include <cmath>

namespace visual_localization {

CloudMoments momentsOf(const std::vector<Particle>& particles) {
  CloudMoments moments;
  double total = 0.0;
  for (const Particle& particle : particles) {
    moments.mean_m += particle.weight * particle.position_m;
    total += particle.weight;
  }
  if (total > 0.0) moments.mean_m /= total;
  moments.covariance_m2 = covarianceAbout(moments.mean_m, particles);
  return moments;
}

Eigen::Matrix2d covarianceAbout(const Eigen::Vector2d& centre_m, const std::vector<Particle>& particles,
                                double radius_m) {
  Eigen::Matrix2d sum = Eigen::Matrix2d::Zero();
  double total = 0.0;
  for (const Particle& particle : particles) {
    const Eigen::Vector2d offset = particle.position_m - centre_m;
    if (offset.norm() > radius_m) continue;
    sum += particle.weight * offset * offset.transpose();
    total += particle.weight;
  }
  return total > 0.0 ? Eigen::Matrix2d(sum / total) : Eigen::Matrix2d::Zero();
}

Eigen::Matrix2d scatterAbout(const Eigen::Vector2d& centre_m, const std::vector<Particle>& particles) {
  Eigen::Matrix2d sum = Eigen::Matrix2d::Zero();
  for (const Particle& particle : particles) {
    const Eigen::Vector2d offset = particle.position_m - centre_m;
    sum += offset * offset.transpose();
  }
  return sum / static_cast<double>(std::max<std::size_t>(1, particles.size()));
}

void normaliseWeights(std::vector<Particle>& particles) {
  double total = 0.0;
  for (const Particle& particle : particles) total += particle.weight;
  const bool usable = total > 0.0 && std::isfinite(total);
  for (Particle& particle : particles) {
    particle.weight = usable ? particle.weight / total : 1.0 / static_cast<double>(particles.size());
  }
}

}  // namespace visual_localization
