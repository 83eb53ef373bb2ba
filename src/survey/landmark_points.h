#pragma once

#include <cstddef>
#include <vector>

#include <Eigen/Core>

#include "visual_localization/map/training_map.h"

namespace visual_localization {

/// A landmark, for people to look at.
struct LandmarkPoint {
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();  ///< map frame
  int session = 0;                                       ///< of the first image that shows it
};

/// Each landmark once, where the first image that shows it has it, in the order of the images. Of a map with more than
/// `most_images` every second image is read, or every third, and so on; of more than `most_points` landmarks likewise.
/// Both at least 1.
std::vector<LandmarkPoint> landmarkPoints(const TrainingMap& map, std::size_t most_images, std::size_t most_points);

}  // namespace visual_localization
