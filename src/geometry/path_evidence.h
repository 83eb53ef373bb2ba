#pragma once

#include <vector>

#include "geometry/bundle_adjustment.h"
#include "geometry/session_geometry.h"
#include "visual_localization/geo/trajectory.h"

namespace visual_localization {

/// Where the fixes have each image: of those around it (nearer to it than to the next image, half a second at most) the
/// median, axis by axis, moved along the cleaned path to the moment of the image, and the median of their sigmas, 2 cm
/// to 10 m, and the velocity along that path; `sigma_m` for fixes without one. Images without such fixes have none.
std::vector<PositionObservation> positionsAt(const std::vector<TrajectoryPoint>& images,
                                             const std::vector<MapFix>& fixes, double sigma_m);

/// How a road rises and falls under the images of a session.
struct PathHeights {
  std::vector<double> up_m;   ///< of each image, above that of the first one
  std::vector<double> slope;  ///< of each image, rise over run in the direction of travel
  double sigma_m = 0.0;       ///< median standard deviation of a fix's altitude
  bool measured = false;      ///< otherwise all is level
};

/// By the altitudes of the fixes near the cleaned path: a line through those within 20 m along the path, for each image
/// (least squares; roads are not steep). Level without altitudes, when all are the same (the receiver measures none),
/// or when there are images that none is near.
PathHeights pathHeights(const std::vector<TrajectoryPoint>& images, const std::vector<MapFix>& fixes);

}  // namespace visual_localization
