#pragma once

#include <optional>

#include <std_msgs/Header.h>
#include <visualization_msgs/Marker.h>

#include "visual_localization/camera/camera_model.h"
#include "visual_localization/localization/estimate.h"

namespace visual_localization {

/// The camera at the estimate's metric pose: lines along the corners of its field of view, and a roof over the upper
/// edge. Takes the one before away when the pose is not metric. `header`: map frame.
visualization_msgs::Marker toCameraMarker(const Estimate& estimate, const std::optional<CameraModel>& camera,
                                          const std_msgs::Header& header);

}  // namespace visual_localization
