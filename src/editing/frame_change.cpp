#include "editing/frame_change.h"

#include <cmath>

namespace visual_localization {
namespace {

bool isSame(const GeodeticPoint& a, const GeodeticPoint& b) {
  return a.latitude_deg == b.latitude_deg && a.longitude_deg == b.longitude_deg && a.altitude_m == b.altitude_m;
}

}  // namespace

FrameChange::FrameChange(const LocalFrame& from, const LocalFrame& to)
    : from_(from), to_(to), same_(isSame(from.datum(), to.datum())) {}

PoseCorrection FrameChange::at(const Eigen::Vector2d& position_m) const {
  if (same_) return {};
  constexpr double kNorth_m = 100.0;  // far enough to tell a direction exactly
  const Eigen::Vector2d here_m = to_.toEastNorth(from_.toGeodetic(position_m));
  const Eigen::Vector2d there_m = to_.toEastNorth(from_.toGeodetic(position_m + kNorth_m * Eigen::Vector2d::UnitY()));
  const Eigen::Vector2d north = there_m - here_m;
  PoseCorrection change;
  change.turn = Eigen::AngleAxisd(std::atan2(-north.x(), north.y()), Eigen::Vector3d::UnitZ());
  change.shift_m.head<2>() = here_m - position_m;
  change.shift_m.z() = from_.datum().altitude_m - to_.datum().altitude_m;
  return change;
}

}  // namespace visual_localization
