#pragma once

#include <functional>
#include <vector>

#include <Eigen/Core>

#include "visual_localization/map/training_map.h"
#include "visual_localization/tracking/particle.h"
#include "visual_localization/tracking/random.h"

namespace visual_localization {

/// Draws a position of the map frame, metres: where the robot may be before any image was seen.
using Prior = std::function<Eigen::Vector2d(Random&)>;

/// Anywhere in the area, uniformly.
Prior anywhere(const Area& area);
/// Uniform in a disc. Throws std::invalid_argument unless the centre is finite and the radius finite and >= 0.
Prior around(const Eigen::Vector2d& centre_m, double radius_m);
/// Normal distribution. Throws std::invalid_argument unless the mean is finite and the covariance finite,
/// symmetric and positive semi-definite.
Prior normallyDistributed(const Eigen::Vector2d& mean_m, const Eigen::Matrix2d& covariance_m2);
/// From the particles of another tracker, whose weights need not sum to one: half of the draws by weight, so that the
/// best places are among few particles too, the other half from all alike, so that rivals are not forgotten. Throws
/// std::invalid_argument when there are none.
Prior drawnFrom(std::vector<Particle> cloud);

}  // namespace visual_localization
