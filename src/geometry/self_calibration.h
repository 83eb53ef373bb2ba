#pragma once

#include <cstddef>
#include <optional>

#include <opencv2/core.hpp>

#include "geometry/session_geometry.h"
#include "visual_localization/camera/camera_model.h"
#include "visual_localization/geometry/geometry_config.h"

namespace visual_localization {

/// The focal length that the images of a session ask for: a pinhole with square pixels and its principal point in the
/// middle, for images of `size`. Two searches come from either side; only when they end at the same focal length the
/// images say what it is, and nothing otherwise. The camera of `session` is not looked at.
std::optional<CameraModel> calibrateByImages(UnadjustedSession session, const cv::Size& size,
                                             const GeometryConfig& config, std::size_t threads);

}  // namespace visual_localization
