#include "survey/landmark_points.h"

#include <cstdint>
#include <unordered_set>

#include "base/statistics.h"

namespace visual_localization {
namespace {

std::vector<LandmarkPoint> everyOf(const std::vector<LandmarkPoint>& points, std::size_t stride) {
  std::vector<LandmarkPoint> some;
  for (std::size_t i = 0; i < points.size(); i += stride) some.push_back(points[i]);
  return some;
}

}  // namespace

std::vector<LandmarkPoint> landmarkPoints(const TrainingMap& map, std::size_t most_images, std::size_t most_points) {
  std::vector<LandmarkPoint> points;
  if (!map.hasGeometry()) return points;
  std::unordered_set<std::uint32_t> known;
  for (std::size_t i = 0; i < map.size(); i += strideFor(map.size(), most_images)) {
    const auto geometry = map.geometry(i);
    if (!geometry) continue;
    for (const SeenLandmark& landmark : geometry->landmarks) {
      if (!known.insert(landmark.id).second) continue;
      points.push_back({geometry->camera.position_m + landmark.offset_m.cast<double>(), map.pose(i).session});
    }
  }
  return points.size() > most_points ? everyOf(points, strideFor(points.size(), most_points)) : points;
}

}  // namespace visual_localization
