#pragma once

#include <optional>
#include <string>

#include "visual_localization/geo/geodetic_point.h"
#include "visual_localization/geo/trajectory.h"

namespace visual_localization {

/// Where a camera truly was.
struct TruePose {
  GeodeticPoint position;
  std::optional<double> yaw_rad = {};  ///< of the viewing direction, 0 = east, counter-clockwise; none: not known
};

/// The poses of a CSV file with at least the columns stamp_ns, east_m, north_m (metres from any origin) and yaw_rad.
/// Throws FileError that begins with the path and names the line.
Trajectory readPoses(const std::string& path);

/// `poses` moved so that they lie on `positions`, whose origin is another one: by the median difference on either axis.
/// Throws std::runtime_error when the two have no time in common.
Trajectory movedOnto(const Trajectory& positions, const Trajectory& poses);

}  // namespace visual_localization
