#pragma once

#include <Eigen/Core>
#include <GeographicLib/LocalCartesian.hpp>

#include "visual_localization/geo/geodetic_point.h"

namespace visual_localization {

/// A tangent plane is no map beyond this distance from its datum, metres.
constexpr double kLargestCoordinate_m = 1e6;

/// Local tangent plane around a datum: x east, y north, metres (REP 103).
class LocalFrame {
 public:
  /// Throws std::invalid_argument when the datum is not finite or outside the ranges of GeodeticPoint.
  explicit LocalFrame(const GeodeticPoint& datum);

  /// East and north of `point` in metres; its altitude is taken as the datum's, because the map is flat.
  Eigen::Vector2d toEastNorth(const GeodeticPoint& point) const;
  /// Inverse of toEastNorth; the altitude is the datum's.
  GeodeticPoint toGeodetic(const Eigen::Vector2d& east_north_m) const;

  const GeodeticPoint& datum() const { return datum_; }

 private:
  GeodeticPoint datum_;
  GeographicLib::LocalCartesian projection_;
};

/// True when latitude and longitude are finite and in range.
bool isValid(const GeodeticPoint& point);
/// True when the receiver claims a fix and its position is valid. Latitude 0 with longitude 0 is what a receiver
/// without a position sends, whatever it claims: a point of the ocean that no fix hits to the last digit.
bool hasPosition(const Fix& fix);

}  // namespace visual_localization
