#include "visual_localization/localization/particles.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>

#include "base/numbers.h"
#include "visual_localization/geo/trajectory.h"

namespace visual_localization {
namespace {

/// False for a number that is not finite.
bool isOnLocalMap(const Eigen::Vector2d& position_m) {
  return (position_m.array().abs() <= kLargestCoordinate_m).all();
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

Prior anywhere(const Area& area) {
  const auto draw = [area](Random& random) {
    const double x = random.uniform(0.0, 1.0);
    const double y = random.uniform(0.0, 1.0);
    return Eigen::Vector2d(area.min_m + Eigen::Vector2d(x, y).cwiseProduct(area.range()));
  };
  return Prior(draw, true);
}

Prior around(const Eigen::Vector2d& centre_m, double radius_m) {
  if (!isOnLocalMap(centre_m))
    throw std::invalid_argument("the centre must be finite and within 1000 km of the origin");
  if (!(radius_m >= 0.0 && radius_m <= kLargestCoordinate_m)) {
    throw std::invalid_argument("the radius must be from 0 to 1000 km, in metres");
  }
  return Prior([centre_m, radius_m](Random& random) {
    const double angle = random.uniform(-kPi, kPi);
    const double distance = radius_m * std::sqrt(random.uniform(0.0, 1.0));
    return Eigen::Vector2d(centre_m + distance * Eigen::Vector2d(std::cos(angle), std::sin(angle)));
  });
}

Prior normallyDistributed(const Eigen::Vector2d& mean_m, const Eigen::Matrix2d& covariance_m2) {
  if (!isOnLocalMap(mean_m))
    throw std::invalid_argument("the position must be finite and within 1000 km of the origin");
  constexpr double kLargestVariance_m2 = kLargestCoordinate_m * kLargestCoordinate_m;
  if (!(covariance_m2.array().abs() <= kLargestVariance_m2).all()) {
    throw std::invalid_argument("the covariance must be finite and at most (1000 km)^2");
  }
  const double scale = std::max(1.0, covariance_m2.cwiseAbs().maxCoeff());
  const double tolerance = 1e-6 * scale;
  if (std::abs(covariance_m2(0, 1) - covariance_m2(1, 0)) > tolerance) {
    throw std::invalid_argument("the covariance must be symmetric");
  }
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> solver;
  solver.computeDirect(covariance_m2);
  if (solver.eigenvalues().minCoeff() < -tolerance) {
    throw std::invalid_argument("the covariance must be positive semi-definite");
  }
  const Eigen::Matrix2d root = solver.eigenvectors() * solver.eigenvalues().cwiseMax(0.0).cwiseSqrt().asDiagonal();
  return Prior([mean_m, root](Random& random) {
    return Eigen::Vector2d(mean_m + root * random.normal(Eigen::Vector2d(1.0, 1.0)));
  });
}

Prior drawnFrom(std::vector<Particle> cloud) {
  if (cloud.empty()) throw std::invalid_argument("a cloud without particles is no prior");
  std::vector<double> cumulated;
  cumulated.reserve(cloud.size());
  double total = 0.0;
  for (const Particle& particle : cloud) cumulated.push_back(total += particle.weight);
  return Prior([cloud = std::move(cloud), cumulated = std::move(cumulated)](Random& random) {
    const double sum = cumulated.back();
    const bool by_weight = random.uniform(0.0, 1.0) < 0.5 && sum > 0.0;
    const double target = random.uniform(0.0, by_weight ? sum : static_cast<double>(cloud.size()));
    const auto found = std::upper_bound(cumulated.begin(), cumulated.end(), target);
    const auto index =
        by_weight ? static_cast<std::size_t>(found - cumulated.begin()) : static_cast<std::size_t>(target);
    return cloud[std::min(index, cloud.size() - 1)].position_m;
  });
}

}  // namespace visual_localization
