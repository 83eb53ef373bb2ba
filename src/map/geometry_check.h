#pragma once

#include <cstddef>

#include "visual_localization/geometry/image_geometry.h"

namespace visual_localization {

/// Of a landmark's offset from the camera, metres: nothing that a camera measures is farther.
constexpr double kLongestOffset_m = 1e5;

/// Refuses what no adjustment finds out about an image with `feature_count` features: numbers that are not finite, a
/// position beyond kLargestCoordinate_m, a rotation that is not of unit length, a covariance that is none or does not
/// fit into floats, an offset longer than kLongestOffset_m, features that are not there or not in order. Throws
/// std::runtime_error.
void requireUsable(const ImageGeometry& geometry, std::size_t feature_count);

}  // namespace visual_localization
