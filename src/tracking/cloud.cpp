#include "visual_localization/tracking/cloud.h"

#include <cmath>

namespace visual_localization {
namespace {

template <class Include>
Eigen::Matrix2d secondMoments(const Eigen::Vector2d& centre_m, const std::vector<Particle>& particles,
                              Include include) {
  Eigen::Matrix2d sum = Eigen::Matrix2d::Zero();
  double total = 0.0;
  for (const Particle& particle : particles) {
    const Eigen::Vector2d offset = particle.position_m - centre_m;
    if (!include(offset)) continue;
    sum += particle.weight * offset * offset.transpose();
    total += particle.weight;
  }
  return total > 0.0 ? Eigen::Matrix2d(sum / total) : Eigen::Matrix2d::Zero();
}

}  // namespace

CloudMoments momentsOf(const std::vector<Particle>& particles) {
  CloudMoments moments;
  double total = 0.0;
  for (const Particle& particle : particles) {
    moments.mean_m += particle.weight * particle.position_m;
    total += particle.weight;
  }
  if (total > 0.0) moments.mean_m /= total;
  moments.covariance_m2 = secondMoments(moments.mean_m, particles, [](const Eigen::Vector2d&) { return true; });
  return moments;
}

Eigen::Matrix2d covarianceAbout(const Eigen::Vector2d& centre_m, double radius_m,
                                const std::vector<Particle>& particles) {
  return secondMoments(centre_m, particles,
                       [radius_m](const Eigen::Vector2d& offset) { return offset.norm() <= radius_m; });
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
