#pragma once

#include <memory>
#include <stdexcept>
#include <string>

#include "visual_localization/geo/trajectory.h"

namespace visual_localization::apps {

/// What is no area on the earth. The text is one line.
class RegionError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Polygons on the earth, with holes.
class Region {
 public:
  /// Every Polygon and MultiPolygon of a GeoJSON text (RFC 7946). Throws RegionError when there is none, or one is no
  /// simple polygon.
  explicit Region(const std::string& geojson);
  ~Region();
  Region(const Region&) = delete;
  Region& operator=(const Region&) = delete;

  /// Also on the border. Edges are straight in latitude and longitude.
  bool contains(const GeodeticPoint& point) const;

 private:
  struct Polygons;
  std::unique_ptr<Polygons> polygons_;
};

}  // namespace visual_localization::apps
