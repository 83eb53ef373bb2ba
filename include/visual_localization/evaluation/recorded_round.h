#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include <opencv2/core.hpp>

#include "visual_localization/features/global_features.h"
#include "visual_localization/features/sift_features.h"
#include "visual_localization/geo/geodetic_point.h"
#include "visual_localization/map/training_map.h"

namespace visual_localization {

/// One image of a round that is driven, as the front end of the localizer sees it.
struct DriveImage {
  std::int64_t stamp_ns = 0;
  std::optional<GeodeticPoint> truth;  ///< absent when it has no true position
  SiftFeatures sift;                   ///< pruned by the image recorded before it
  GlobalFeatures global;
};

/// A round as images to localise.
struct Drive {
  std::vector<DriveImage> images;
  cv::Size image_size;     ///< pixels
  double sift_ms = 0.0;    ///< mean time to extract and prune the SIFT features of an image
  double global_ms = 0.0;  ///< mean time to extract its global features
};

/// A round in the roles it plays in an experiment; a role it does not play is empty.
struct RecordedRound {
  std::shared_ptr<const TrainingMap> map;
  std::shared_ptr<const Drive> drive;
};

}  // namespace visual_localization
