#include "survey/landmark_survey.h"

#include <algorithm>
#include <cstdint>
#include <unordered_set>
#include <vector>

#include "base/statistics.h"
#include "map/packed_geometry.h"

namespace visual_localization {
namespace {

std::vector<LandmarkPoint> everyOf(const std::vector<LandmarkPoint>& points, std::size_t stride) {
  std::vector<LandmarkPoint> some;
  for (std::size_t i = 0; i < points.size(); i += stride) some.push_back(points[i]);
  return some;
}

/// Counts different numbers in memory for no more than twice as many.
class DifferentNumbers {
 public:
  void add(std::uint32_t number) {
    if (numbers_.size() >= most_) most_ = std::max(most_, 2 * count());
    numbers_.push_back(number);
  }

  std::size_t count() {
    std::sort(numbers_.begin(), numbers_.end());
    numbers_.erase(std::unique(numbers_.begin(), numbers_.end()), numbers_.end());
    return numbers_.size();
  }

 private:
  std::vector<std::uint32_t> numbers_;
  std::size_t most_ = std::size_t{1} << 20U;
};

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

LandmarkSurvey landmarkSurvey(const TrainingMap& map, std::size_t most_images) {
  LandmarkSurvey survey;
  survey.images = map.geometryCount();
  if (survey.images == 0) return survey;
  const std::size_t stride = strideFor(map.size(), most_images);
  std::vector<std::size_t> counts;
  DifferentNumbers ids;
  for (std::size_t i = 0; i < map.size(); i += stride) {
    const auto geometry = map.geometry(i);
    if (!geometry) continue;
    counts.push_back(geometry->landmarks.size());
    survey.bytes += map_schema::kPoseBytes + counts.back() * map_schema::landmarkBytes(map.featureCount(i));
    for (const SeenLandmark& landmark : geometry->landmarks) ids.add(landmark.id);
  }
  survey.images_read = counts.size();
  if (!counts.empty()) survey.median = upperMedian(counts);
  if (stride == 1) survey.landmarks = ids.count();
  return survey;
}

}  // namespace visual_localization
