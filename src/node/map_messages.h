#pragma once

#include <string>

#include <nav_msgs/Path.h>
#include <visualization_msgs/MarkerArray.h>

#include "visual_localization/map/training_map.h"

namespace visual_localization {

/// The recorded path, image by image, session by session. Of a map with more than 20000 images only every second one,
/// or every third, and so on: here and in the markers.
nav_msgs::Path toPath(const TrainingMap& map, const std::string& frame_id);

/// Positions and headings of the training images, per session, and the landmarks as points coloured by height: each
/// landmark once, of at most 5000 images and at most 200000 points, evenly chosen. Begins with a marker that deletes
/// those of an earlier map.
visualization_msgs::MarkerArray toMarkers(const TrainingMap& map, const std::string& frame_id);

}  // namespace visual_localization
