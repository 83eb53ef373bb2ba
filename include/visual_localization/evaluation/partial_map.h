#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "visual_localization/map/training_map.h"

namespace visual_localization {

/// A map with some of its images left out, as when the robot leaves the recorded way.
struct PartialMap {
  std::shared_ptr<const TrainingMap> map;
  std::vector<std::size_t> images;  ///< index in the whole map of each image that is left; empty when all are
};

/// Leaves out `share` of the images, beginning with image 0.35 * size; all stay when it is 0. At least one stays.
PartialMap withGap(std::shared_ptr<const TrainingMap> map, double share);

}  // namespace visual_localization
