#pragma once

#include <cstddef>
#include <optional>
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

/// What the landmarks of a map amount to. Their images are known without reading, all else is of the images read.
struct LandmarkSurvey {
  std::size_t images = 0;                ///< with a geometry, of the whole map
  std::size_t images_read = 0;           ///< of those
  std::size_t median = 0;                ///< landmarks of an image read; of an even number the larger in the middle
  std::size_t bytes = 0;                 ///< that the images read take in the file
  std::optional<std::size_t> landmarks;  ///< different ones; unknown unless all images were read
};

/// `most_images`: at least 1; of a map that has more, at most so many are read, evenly spread.
LandmarkSurvey landmarkSurvey(const TrainingMap& map, std::size_t most_images);

}  // namespace visual_localization
