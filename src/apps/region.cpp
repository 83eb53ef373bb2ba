#include "apps/region.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include <boost/geometry/algorithms/correct.hpp>
#include <boost/geometry/algorithms/covered_by.hpp>
#include <boost/geometry/algorithms/is_valid.hpp>
#include <boost/geometry/geometries/multi_polygon.hpp>
#include <boost/geometry/geometries/point_xy.hpp>
#include <boost/geometry/geometries/polygon.hpp>
#include <boost/geometry/strategies/strategies.hpp>
#include <nlohmann/json.hpp>

#include "base/text.h"
#include "visual_localization/geo/trajectory.h"

namespace visual_localization::apps {
namespace {

namespace bg = boost::geometry;
using nlohmann::json;
using Point = bg::model::d2::point_xy<double>;
using Polygon = bg::model::polygon<Point>;
using Ring = Polygon::ring_type;

constexpr std::size_t kMostPoints = 100'000;  ///< more are no polygon that someone drew

constexpr double kFarthest_m = 1e7;  ///< from the origin of a map

Point pointOf(const json& position, RegionFrame frame) {
  const bool in_metres = frame == RegionFrame::kMap;
  if (!position.is_array() || position.size() < 2 || !position[0].is_number() || !position[1].is_number()) {
    throw RegionError(in_metres ? "a position must be [east, north] in metres"
                                : "a position must be [longitude, latitude] in degrees");
  }
  if (in_metres) {
    const Point point(position[0].get<double>(), position[1].get<double>());
    if (std::max(std::abs(point.x()), std::abs(point.y())) <= kFarthest_m) return point;
    throw RegionError("position [" + position[0].dump() + ", " + position[1].dump() +
                      "] must be in [-10000000, 10000000] metres");
  }
  const GeodeticPoint point{position[1].get<double>(), position[0].get<double>(), 0.0};
  if (!isValid(point)) {
    throw RegionError("position [" + position[0].dump() + ", " + position[1].dump() +
                      "] must be a longitude in [-180, 180] and a latitude in [-90, 90] degrees");
  }
  return {point.longitude_deg, point.latitude_deg};
}

Ring ringOf(const json& positions, RegionFrame frame) {
  constexpr std::size_t kLeast = 4;  // the last is the first again
  if (!positions.is_array() || positions.size() < kLeast || positions.front() != positions.back()) {
    throw RegionError("a ring of a polygon must have at least 4 positions, the last one as the first");
  }
  if (positions.size() > kMostPoints) throw RegionError("a ring of a polygon has more than 100000 positions");
  Ring ring;
  for (const json& position : positions) ring.push_back(pointOf(position, frame));
  return ring;
}

Polygon polygonOf(const json& rings, RegionFrame frame) {
  if (!rings.is_array() || rings.empty()) throw RegionError("a polygon must have a ring");
  Polygon polygon;
  polygon.outer() = ringOf(rings[0], frame);
  for (std::size_t i = 1; i < rings.size(); ++i) polygon.inners().push_back(ringOf(rings[i], frame));
  bg::correct(polygon);
  std::string reason;
  if (!bg::is_valid(polygon, reason)) throw RegionError("a polygon is not simple: " + oneLine(reason));
  return polygon;
}

const json& member(const json& object, const char* name) {
  const auto found = object.find(name);
  if (found == object.end()) throw RegionError(std::string("no GeoJSON: '") + name + "' is missing");
  return *found;
}

const json& list(const json& object, const char* name) {
  const json& value = member(object, name);
  if (!value.is_array()) throw RegionError(std::string("no GeoJSON: '") + name + "' must be a list");
  return value;
}

void addPolygons(const json& object, RegionFrame frame, std::vector<Polygon>& polygons) {
  if (!object.is_object()) throw RegionError("no GeoJSON: an object was expected");
  const json& type = member(object, "type");
  if (type == "Polygon") polygons.push_back(polygonOf(member(object, "coordinates"), frame));
  if (type == "MultiPolygon") {
    for (const json& rings : list(object, "coordinates")) polygons.push_back(polygonOf(rings, frame));
  }
  if (type == "Feature" && !member(object, "geometry").is_null()) addPolygons(object["geometry"], frame, polygons);
  if (type == "FeatureCollection") {
    for (const json& feature : list(object, "features")) addPolygons(feature, frame, polygons);
  }
  if (type == "GeometryCollection") {
    for (const json& geometry : list(object, "geometries")) addPolygons(geometry, frame, polygons);
  }
}

/// Collections in collections: each level costs stack.
bool isDeep(int depth, json::parse_event_t /*event*/, json& /*parsed*/) {
  constexpr int kDeepest = 20;
  if (depth > kDeepest) throw RegionError("no GeoJSON: it is nested more than 20 deep");
  return true;
}

json parsed(const std::string& text) {
  try {
    return json::parse(text, isDeep);
  } catch (const json::exception& error) {
    throw RegionError("no JSON: " + oneLine(error.what()));
  }
}

}  // namespace

struct Region::Polygons {
  RegionFrame frame = RegionFrame::kEarth;
  std::vector<Polygon> polygons;

  bool contain(const Point& at) const {
    return std::any_of(polygons.begin(), polygons.end(),
                       [&](const Polygon& polygon) { return bg::covered_by(at, polygon); });
  }
};

Region::Region(const std::string& geojson, RegionFrame frame) : polygons_(std::make_unique<Polygons>()) {
  polygons_->frame = frame;
  addPolygons(parsed(geojson), frame, polygons_->polygons);
  if (polygons_->polygons.empty()) throw RegionError("has no Polygon and no MultiPolygon");
}

Region::~Region() = default;

bool Region::contains(const GeodeticPoint& point) const {
  return polygons_->contain({point.longitude_deg, point.latitude_deg});
}

bool Region::contains(const Eigen::Vector2d& position_m, const LocalFrame& frame) const {
  if (polygons_->frame == RegionFrame::kEarth) return contains(frame.toGeodetic(position_m));
  return polygons_->contain({position_m.x(), position_m.y()});
}

}  // namespace visual_localization::apps
