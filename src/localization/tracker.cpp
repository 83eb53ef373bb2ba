#include "visual_localization/localization/tracker.h"

#include "localization/dpso.h"
#include "localization/particle_filter.h"
#include "localization/session_choice.h"

namespace visual_localization {

Neighbour TrackerInput::nearest(const TrainingMap& map, const Eigen::Vector2d& position_m) const {
  return sessions == nullptr ? map.nearest(position_m) : sessions->nearest(position_m);
}

std::unique_ptr<Tracker> makeTracker(const TrainingMap& map, const TrackerConfig& config, std::uint32_t seed) {
  if (config.tracker == "dpso") return std::make_unique<Dpso>(map, config.dpso, config.fitness, seed, config.odometry);
  return std::make_unique<ParticleFilter>(map, makeMotionModel(config.tracker, config.pf, map, config.odometry),
                                          config.pf, config.fitness, seed);
}

}  // namespace visual_localization
