// Where the particles of the swarm may go.
#include <algorithm>

#include "localization/dpso.h"
#include "visual_localization/geo/local_frame.h"

namespace visual_localization {
namespace {

/// Keeps a particle inside the area and stops the velocity that led out of it.
void keepInside(Particle& particle, const Area& area) {
  for (int axis = 0; axis < 2; ++axis) {
    const double inside = std::clamp(particle.position_m[axis], area.min_m[axis], area.max_m[axis]);
    if (inside != particle.position_m[axis]) particle.velocity_m[axis] = 0.0;
    particle.position_m[axis] = inside;
  }
}

/// Keeps a particle this close to a position and stops the velocity that led away from it.
void keepNear(Particle& particle, const Eigen::Vector2d& position_m, double farthest_m) {
  const Eigen::Vector2d offset_m = particle.position_m - position_m;
  const double distance_m = offset_m.norm();
  if (distance_m <= farthest_m) return;
  const Eigen::Vector2d away = offset_m / distance_m;
  particle.position_m = position_m + farthest_m * away;
  particle.velocity_m -= std::max(0.0, particle.velocity_m.dot(away)) * away;
}

Area wholeFrame() {
  const Eigen::Vector2d farthest_m = Eigen::Vector2d::Constant(kLargestCoordinate_m);
  return {-farthest_m, farthest_m};
}

}  // namespace

/// The papers let particles go where they will; nothing is known of positions outside of the map's frame.
void Dpso::confine(Particle& particle) const {
  if (config_.confine == "box") return keepInside(particle, area_);
  keepInside(particle, wholeFrame());
  if (config_.confine == "none") return;
  const std::size_t nearest = map_.nearest(particle.position_m).image;
  keepNear(particle, map_.position_m(nearest), config_.corridor_m);
}

}  // namespace visual_localization
