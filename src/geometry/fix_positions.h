#pragma once

#include <vector>

#include "geometry/bundle_adjustment.h"
#include "geometry/session_geometry.h"

namespace visual_localization {

/// Where the fixes have each image: of those around it (nearer to it than to the next image, half a second at most) the
/// median, axis by axis, moved along the cleaned path to the moment of the image, and the median of their sigmas, 2 cm
/// to 10 m, and the velocity along that path; `sigma_m` for fixes without one. Images without such fixes have none.
std::vector<PositionObservation> positionsAt(const std::vector<TrajectoryPoint>& images,
                                             const std::vector<MapFix>& fixes, double sigma_m);

}  // namespace visual_localization
