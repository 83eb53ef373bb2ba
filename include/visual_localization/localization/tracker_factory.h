#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

#include "visual_localization/localization/dpso_config.h"
#include "visual_localization/localization/particle_filter.h"
#include "visual_localization/localization/tracker.h"

namespace visual_localization {

/// Which tracker, and the parameters of all of them.
struct TrackerConfig {
  std::string tracker = "dpso";  ///< "dpso", "pf_gaussian" or "pf_linear"
  DpsoConfig dpso;
  ParticleFilterConfig pf;
  FitnessConfig fitness;

  /// Number of particles of the chosen tracker.
  std::size_t particles() const { return static_cast<std::size_t>(tracker == "dpso" ? dpso.particles : pf.particles); }
};

/// The chosen tracker, with its particles anywhere in the map. `map` must outlive it.
std::unique_ptr<Tracker> makeTracker(const TrainingMap& map, const TrackerConfig& config, std::uint32_t seed);

}  // namespace visual_localization
