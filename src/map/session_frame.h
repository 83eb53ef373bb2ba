#pragma once

#include <vector>

#include "geometry/session_geometry.h"
#include "visual_localization/geo/local_frame.h"
#include "visual_localization/geo/trajectory_cleaner.h"

/// Where the recordings of a map lie. What is refused is a std::runtime_error in one line.
namespace visual_localization {

/// A frame around the first believable fix.
LocalFrame frameFor(const std::vector<Fix>& fixes, const TrajectoryCleanerConfig& config);
/// On the earth, since a tangent plane shows its far side near the datum again.
double distanceBetween_m(const GeodeticPoint& a, const GeodeticPoint& b);
/// Refuses fixes whose middle is farther than kFarthestSession_m from the datum.
void requireNear(const std::vector<Fix>& fixes, const GeodeticPoint& datum);
/// Refuses a path that spans less than kSmallestSession_m: all images of the drive would be on one spot.
void requireMotion(const CleanedTrajectory& cleaned);
/// Those that have a position, in order of time.
std::vector<MapFix> inFrame(const std::vector<Fix>& fixes, const LocalFrame& frame);

}  // namespace visual_localization
