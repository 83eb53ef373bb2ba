#pragma once

#include <string>

#include <nav_msgs/Path.h>
#include <visualization_msgs/MarkerArray.h>

#include "visual_localization/map/training_map.h"

namespace visual_localization {

/// The recorded path, image by image; the sessions follow each other. Of a map with more than 20000 images every
/// second one, or every third, and so on: here and in the markers.
nav_msgs::Path toPath(const TrainingMap& map, const std::string& frame_id);

/// Per session the places of the training images and the direction each one looks at. Begins with a marker
/// that deletes those of an earlier map.
visualization_msgs::MarkerArray toMarkers(const TrainingMap& map, const std::string& frame_id);

}  // namespace visual_localization
