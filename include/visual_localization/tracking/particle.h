#pragma once

#include <cstdint>

#include <Eigen/Core>

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

}  // namespace visual_localization
