#include "visual_localization/geo/trajectory.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "base/numbers.h"
#include "base/time.h"

namespace visual_localization {
namespace {

const GeodeticPoint& checked(const GeodeticPoint& datum) {
  if (!isValid(datum) || !std::isfinite(datum.altitude_m)) {
    throw std::invalid_argument("datum must be finite, latitude in [-90, 90], longitude in [-180, 180] degrees");
  }
  return datum;
}

}  // namespace

bool isValid(const GeodeticPoint& point) {
  return std::abs(point.latitude_deg) <= 90.0 && std::abs(point.longitude_deg) <= 180.0;
}

bool hasPosition(const Fix& fix) {
  const bool is_origin = fix.position.latitude_deg == 0.0 && fix.position.longitude_deg == 0.0;
  return fix.has_fix && isValid(fix.position) && !is_origin;
}

LocalFrame::LocalFrame(const GeodeticPoint& datum)
    : datum_(checked(datum)), projection_(datum.latitude_deg, datum.longitude_deg, datum.altitude_m) {}

Eigen::Vector2d LocalFrame::toEastNorth(const GeodeticPoint& point) const {
  double east_m = 0.0;
  double north_m = 0.0;
  double up_m = 0.0;
  projection_.Forward(point.latitude_deg, point.longitude_deg, datum_.altitude_m, east_m, north_m, up_m);
  return {east_m, north_m};
}

GeodeticPoint LocalFrame::toGeodetic(const Eigen::Vector2d& east_north_m) const {
  // A point at the datum's altitude lies below the tangent plane by its squared distance over the diameter of the
  // earth; one correction makes the way back exact to micrometres over tens of kilometres.
  GeodeticPoint point;
  projection_.Reverse(east_north_m.x(), east_north_m.y(), 0.0, point.latitude_deg, point.longitude_deg,
                      point.altitude_m);
  const double drop_m = datum_.altitude_m - point.altitude_m;
  projection_.Reverse(east_north_m.x(), east_north_m.y(), drop_m, point.latitude_deg, point.longitude_deg,
                      point.altitude_m);
  point.altitude_m = datum_.altitude_m;
  return point;
}

Trajectory::Trajectory(std::vector<TrajectoryPoint> points, double max_gap_s)
    : points_(std::move(points)), max_gap_s_(max_gap_s) {
  for (std::size_t i = 0; i < points_.size(); ++i) {
    if (!points_[i].position_m.allFinite() || !std::isfinite(points_[i].yaw_rad)) {
      throw std::invalid_argument("trajectory: point " + std::to_string(i) + " is not finite");
    }
    if (i > 0 && points_[i].stamp_ns <= points_[i - 1].stamp_ns) {
      throw std::invalid_argument("trajectory: point " + std::to_string(i) + " is not later than the one before");
    }
  }
}

std::optional<TrajectoryPoint> Trajectory::at(std::int64_t stamp_ns) const {
  const auto after = std::lower_bound(points_.begin(), points_.end(), stamp_ns,
                                      [](const TrajectoryPoint& point, std::int64_t t) { return point.stamp_ns < t; });
  if (after == points_.end()) return std::nullopt;
  if (after->stamp_ns == stamp_ns) return *after;
  if (after == points_.begin()) return std::nullopt;
  const auto before = std::prev(after);
  if (isGap(*before, *after)) return std::nullopt;
  const double share = secondsBetween(before->stamp_ns, stamp_ns) / secondsBetween(before->stamp_ns, after->stamp_ns);
  TrajectoryPoint point;
  point.stamp_ns = stamp_ns;
  point.position_m = before->position_m + share * (after->position_m - before->position_m);
  point.yaw_rad = std::remainder(before->yaw_rad + share * angleDifference(before->yaw_rad, after->yaw_rad), 2.0 * kPi);
  return point;
}

double Trajectory::length() const {
  double sum_m = 0.0;
  for (std::size_t i = 1; i < points_.size(); ++i) {
    if (!isGap(points_[i - 1], points_[i])) sum_m += (points_[i].position_m - points_[i - 1].position_m).norm();
  }
  return sum_m;
}

bool Trajectory::isGap(const TrajectoryPoint& before, const TrajectoryPoint& after) const {
  return secondsBetween(before.stamp_ns, after.stamp_ns) > max_gap_s_;
}

}  // namespace visual_localization
