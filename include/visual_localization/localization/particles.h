#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <random>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "visual_localization/map/training_map.h"

namespace visual_localization {

/// What rule moves a particle of the swarm; a particle filter knows only standard ones.
enum class ParticleKind : std::uint8_t { kStandard = 0, kQuantum = 1, kHighEnergy = 2 };

/// One hypothesis of where the robot is.
struct Particle {
  Eigen::Vector2d position_m = Eigen::Vector2d::Zero();  ///< east, north in the map frame
  Eigen::Vector2d velocity_m = Eigen::Vector2d::Zero();  ///< metres per image
  double weight = 0.0;                                   ///< share of the fitness; all weights sum to one
  ParticleKind kind = ParticleKind::kStandard;
};

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

/// Where the robot may be before any image was seen: draws a position of the map frame, metres.
class Prior {
 public:
  using Draw = std::function<Eigen::Vector2d(Random&)>;

  /// `unknown`: anywhere in the map.
  explicit Prior(Draw draw, bool unknown = false) : draw_(std::move(draw)), unknown_(unknown) {}

  Eigen::Vector2d operator()(Random& random) const { return draw_(random); }
  bool isUnknown() const { return unknown_; }

 private:
  Draw draw_;
  bool unknown_;
};

/// Anywhere in the area, uniformly: the position is unknown.
Prior anywhere(const Area& area);
/// Uniform in a disc. Throws std::invalid_argument unless the centre may lie on a local map (see kLargestCoordinate_m)
/// and the radius is from 0 to the size of one.
Prior around(const Eigen::Vector2d& centre_m, double radius_m);
/// Normal distribution. Throws std::invalid_argument unless the mean may lie on a local map and the covariance is no
/// larger than one, symmetric and positive semi-definite.
Prior normallyDistributed(const Eigen::Vector2d& mean_m, const Eigen::Matrix2d& covariance_m2);
/// From the particles of another tracker, whose weights need not sum to one: half of the draws by weight, so that the
/// best positions are among few particles too, the other half from all alike, so that rivals are not forgotten. Throws
/// std::invalid_argument when there are none.
Prior drawnFrom(std::vector<Particle> cloud);

}  // namespace visual_localization
