#include "visual_localization/geo/local_frame.h"

#include <cmath>
#include <stdexcept>

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

}  // namespace visual_localization
