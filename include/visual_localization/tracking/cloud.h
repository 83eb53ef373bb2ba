#pragma once

#include <limits>
#include <vector>

#include <Eigen/Core>

#include "visual_localization/tracking/particle.h"

namespace visual_localization {

/// Mean and covariance of a weighted cloud, metres.
struct CloudMoments {
  Eigen::Vector2d mean_m = Eigen::Vector2d::Zero();
  Eigen::Matrix2d covariance_m2 = Eigen::Matrix2d::Zero();
  /// sigma_x and sigma_y of Weiss et al., Eq. 2.
  Eigen::Vector2d spread() const { return covariance_m2.diagonal().cwiseMax(0.0).cwiseSqrt(); }
};

/// Moments of the whole cloud.
CloudMoments momentsOf(const std::vector<Particle>& particles);
/// Second moments about `centre_m` of the particles within `radius_m` of it (default: all); zero when their
/// weights sum to zero.
Eigen::Matrix2d covarianceAbout(const Eigen::Vector2d& centre_m, const std::vector<Particle>& particles,
                                double radius_m = std::numeric_limits<double>::infinity());
/// Second moments about `centre_m` of all particles, each counted the same: how far the search reaches, also when a
/// single false match holds all the weight.
Eigen::Matrix2d scatterAbout(const Eigen::Vector2d& centre_m, const std::vector<Particle>& particles);
/// Scales the weights to sum one; all equal when their sum is not positive.
void normaliseWeights(std::vector<Particle>& particles);

}  // namespace visual_localization
