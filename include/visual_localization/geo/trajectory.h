#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include <Eigen/Core>
#include <GeographicLib/LocalCartesian.hpp>

namespace visual_localization {

/// A position on the WGS84 ellipsoid.
struct GeodeticPoint {
  double latitude_deg = 0.0;   ///< north positive, [-90, 90]
  double longitude_deg = 0.0;  ///< east positive, [-180, 180]
  double altitude_m = 0.0;     ///< above the ellipsoid
};

/// One reading of a GPS receiver. Whatever the receiver reported is kept: cleaning decides what to believe.
struct Fix {
  std::int64_t stamp_ns = 0;  ///< nanoseconds since the epoch of the recording
  GeodeticPoint position;     ///< may hold NaN when there is no fix
  bool has_fix = false;       ///< the receiver's own claim
  double sigma_m = 0.0;       ///< horizontal standard deviation per axis by the receiver's own claim; 0: none
  double sigma_up_m = 0.0;    ///< that of the altitude; 0: none
};

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

/// Where the robot was and where it was heading.
struct TrajectoryPoint {
  std::int64_t stamp_ns = 0;
  Eigen::Vector2d position_m = Eigen::Vector2d::Zero();  ///< east, north in the local frame
  double yaw_rad = 0.0;                                  ///< direction of travel, 0 = east, counter-clockwise
};

/// A driven path as a function of time.
class Trajectory {
 public:
  Trajectory() = default;
  /// Points must be finite and in strictly increasing order of stamp; throws std::invalid_argument otherwise.
  /// Nothing is known between points that are more than `max_gap_s` apart.
  explicit Trajectory(std::vector<TrajectoryPoint> points, double max_gap_s = std::numeric_limits<double>::infinity());

  /// Linear interpolation (yaw along the shorter arc); nothing outside the recorded time or inside a gap.
  std::optional<TrajectoryPoint> at(std::int64_t stamp_ns) const;

  const std::vector<TrajectoryPoint>& points() const { return points_; }
  /// Length of the path in metres, gaps not counted.
  double length() const;

 private:
  bool isGap(const TrajectoryPoint& before, const TrajectoryPoint& after) const;

  std::vector<TrajectoryPoint> points_;
  double max_gap_s_ = std::numeric_limits<double>::infinity();
};

}  // namespace visual_localization
