#pragma once

#include <vector>

#include "visual_localization/localization/tracker.h"
#include "visual_localization/map/training_map.h"

namespace visual_localization {

/// Direction of travel of the training images around an estimate.
struct Heading {
  double yaw_rad = 0.0;
  double variance_rad2 = 0.0;  ///< how much they differ from it
};

/// That of the training image nearest to the estimate. Where the route was driven both ways that may face the other
/// way; so if `recognised`, which says that the best match is close by and good, images that face away from the best
/// match are left out. `neighbours` is memory to work in.
Heading headingOf(const TrainingMap& map, const TrackerEstimate& tracked, bool recognised,
                  std::vector<Neighbour>& neighbours);

}  // namespace visual_localization
