#pragma once

#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "visual_localization/features/global_features.h"
#include "visual_localization/features/sift_features.h"

namespace visual_localization {

/// Where and when an image of the map was taken.
struct TrainingPlace {
  std::int64_t stamp_ns = 0;
  int session = 0;                                       ///< which of MapHeader::sessions it came from
  Eigen::Vector2d position_m = Eigen::Vector2d::Zero();  ///< east, north in the map frame
  double yaw_rad = 0.0;                                  ///< direction of travel, 0 = east, counter-clockwise
};

/// One image of the map: where it was taken and what it looked like.
struct TrainingImage : TrainingPlace {
  SiftFeatures sift;                       ///< after pruning
  GlobalFeatures global;                   ///< of the whole image
  std::vector<std::uint8_t> preview_jpeg;  ///< small grey JPEG for people; may be empty
};

}  // namespace visual_localization
