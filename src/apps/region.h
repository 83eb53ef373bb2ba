#pragma once

#include <memory>
#include <stdexcept>
#include <string>

#include <Eigen/Core>

#include "visual_localization/geo/trajectory.h"

namespace visual_localization::apps {

/// What is no area. The text is one line.
class RegionError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// What the positions of polygons are.
enum class RegionFrame {
  kEarth,  ///< longitude, latitude in degrees (RFC 7946)
  kMap,    ///< east, north in metres of a map's frame
};

/// Polygons with holes.
class Region {
 public:
  /// Every Polygon and MultiPolygon of a GeoJSON text. Throws RegionError when there is none, or one is no simple
  /// polygon.
  explicit Region(const std::string& geojson, RegionFrame frame = RegionFrame::kEarth);
  ~Region();
  Region(const Region&) = delete;
  Region& operator=(const Region&) = delete;

  // Also on the border. Edges are straight in the frame of the polygons.
  bool contains(const GeodeticPoint& point) const;  ///< of polygons on the earth
  /// Of either polygons; `frame` is the map's.
  bool contains(const Eigen::Vector2d& position_m, const LocalFrame& frame) const;

 private:
  struct Polygons;
  std::unique_ptr<Polygons> polygons_;
};

}  // namespace visual_localization::apps
