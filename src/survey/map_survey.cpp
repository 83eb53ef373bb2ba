#include "survey/map_survey.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <unordered_set>
#include <utility>
#include <vector>

#include "base/numbers.h"
#include "map/map_schema.h"

namespace visual_localization {
namespace {

/// Of the cell `dx`, `dy` beside the one at `position_m`. A map reaches 10^6 m, so each index fits into 32 bits.
std::uint64_t keyAt(const Eigen::Vector2d& position_m, int dx, int dy) {
  constexpr std::int64_t kZero = std::int64_t{1} << 31U;
  const auto column = static_cast<std::int64_t>(std::floor(position_m.x() / SightGrid::kCell_m)) + dx + kZero;
  const auto row = static_cast<std::int64_t>(std::floor(position_m.y() / SightGrid::kCell_m)) + dy + kZero;
  return static_cast<std::uint64_t>(column) << 32U | static_cast<std::uint64_t>(row);
}

using LastOfSession = std::vector<std::optional<std::size_t>>;

/// Calls `use(image, image before it in its session or nothing)` for all images.
template <class Use>
void forEachStep(const TrainingMap& map, Use use) {
  LastOfSession last(map.header().sessions.size());
  for (std::size_t i = 0; i < map.size(); ++i) {
    auto& before = last[static_cast<std::size_t>(map.pose(i).session)];
    use(i, before);
    before = i;
  }
}

double between_m(const TrainingMap& map, std::size_t a, std::size_t b) {
  return (map.position_m(a) - map.position_m(b)).norm();
}

SightGrid gridOf(const TrainingMap& map, const OfImage& belongs) {
  SightGrid grid;
  for (std::size_t i = 0; i < map.size(); ++i) {
    if (belongs(i)) grid.add(map.position_m(i), map.yaw_rad(i), map.pose(i).session);
  }
  return grid;
}

void addImage(const TrainingPose& pose, SessionSurvey& session) {
  session.first_ns = session.images == 0 ? pose.stamp_ns : std::min(session.first_ns, pose.stamp_ns);
  session.last_ns = session.images == 0 ? pose.stamp_ns : std::max(session.last_ns, pose.stamp_ns);
  ++session.images;
}

/// Quantiles and the longest. Reorders.
void summarise(std::vector<Step>& steps, std::size_t most_listed, MapSurvey& result) {
  if (steps.empty()) return;
  // Of equally long ones the first in the map, so that the answer does not depend on the algorithm.
  std::sort(steps.begin(), steps.end(), [](const Step& a, const Step& b) {
    return a.length_m != b.length_m ? a.length_m > b.length_m : a.to < b.to;
  });
  std::vector<double> lengths_m;
  for (const Step& step : steps) lengths_m.push_back(step.length_m);
  result.median_step_m = nearestRank(lengths_m, 0.5);
  result.long_step_m = nearestRank(lengths_m, 0.95);
  steps.resize(std::min(steps.size(), most_listed));
  result.longest_steps = std::move(steps);
}

void addStep(const TrainingPose& pose, double length_m, const SightGrid& grid, MapSurvey& result) {
  SessionSurvey& session = result.sessions[static_cast<std::size_t>(pose.session)];
  const bool shared = grid.otherSession(pose.position_m, pose.yaw_rad, pose.session);
  result.driven_m += length_m;
  session.driven_m += length_m;
  if (shared) session.shared_m += length_m;
  result.heading_m[static_cast<std::size_t>(octantOf(pose.yaw_rad))] += length_m;
  if (!grid.oppositeWay(pose.position_m, pose.yaw_rad)) result.one_way_m += length_m;
  if (grid.earlierSession(pose.position_m, pose.yaw_rad, pose.session)) return;
  result.route_m += length_m;
  if (shared) result.shared_m += length_m;
}

}  // namespace

int octantOf(double yaw_rad) {
  const auto octant = static_cast<int>(std::lround(std::remainder(yaw_rad, 2.0 * kPi) / (kPi / 4.0)));
  return (octant + kOctants) % kOctants;
}

void SightGrid::add(const Eigen::Vector2d& position_m, double yaw_rad, int session) {
  TwoSessions& seen = cells_[keyAt(position_m, 0, 0)][static_cast<std::size_t>(octantOf(yaw_rad))];
  if (seen.first == -1 || session < seen.first) {
    if (seen.first != -1) seen.second = seen.first;
    seen.first = session;
  } else if (session != seen.first) {
    seen.second = session;
  }
}

template <class Predicate>
bool SightGrid::anyHere(const Eigen::Vector2d& position_m, int octant, Predicate holds) const {
  for (int dx = -1; dx <= 1; ++dx) {
    const std::uint64_t last = keyAt(position_m, dx, 1);
    auto cell = cells_.lower_bound(keyAt(position_m, dx, -1));
    for (; cell != cells_.end() && cell->first <= last; ++cell) {
      for (int turn = -1; turn <= 1; ++turn) {
        const TwoSessions& seen = cell->second[static_cast<std::size_t>((octant + turn + kOctants) % kOctants)];
        if (seen.first != -1 && holds(seen)) return true;
      }
    }
  }
  return false;
}

bool SightGrid::otherSession(const Eigen::Vector2d& position_m, double yaw_rad, int session) const {
  return anyHere(position_m, octantOf(yaw_rad),
                 [session](const TwoSessions& seen) { return seen.first != session || seen.second != -1; });
}

bool SightGrid::earlierSession(const Eigen::Vector2d& position_m, double yaw_rad, int session) const {
  return anyHere(position_m, octantOf(yaw_rad), [session](const TwoSessions& seen) { return seen.first < session; });
}

bool SightGrid::oppositeWay(const Eigen::Vector2d& position_m, double yaw_rad) const {
  return anyHere(position_m, (octantOf(yaw_rad) + kOctants / 2) % kOctants, [](const TwoSessions&) { return true; });
}

std::vector<Stretch> stretchesOf(const TrainingMap& map, double gap_m, const OfImage& belongs,
                                 const OfImage& seen_elsewhere) {
  std::vector<Stretch> stretches;
  std::vector<std::optional<std::size_t>> open(map.header().sessions.size());  // of each session: into `stretches`
  forEachStep(map, [&](std::size_t i, std::optional<std::size_t> before) {
    const int session = map.pose(i).session;
    auto& current = open[static_cast<std::size_t>(session)];
    if (!belongs(i)) {
      current.reset();
      return;
    }
    const double step_m = before ? between_m(map, *before, i) : 0.0;
    if (!current || step_m > gap_m) {
      current = stretches.size();
      stretches.push_back({session, i, i, 0, 0.0, map.featureCount(i), 0});
    } else {
      stretches[*current].length_m += step_m;
    }
    Stretch& stretch = stretches[*current];
    stretch.last = i;
    ++stretch.images;
    if (seen_elsewhere && seen_elsewhere(i)) ++stretch.seen_elsewhere;
    stretch.least_features = std::min(stretch.least_features, map.featureCount(i));
  });
  return stretches;
}

MapSurvey survey(const TrainingMap& map, const SurveyConfig& config) {
  MapSurvey result;
  result.sessions.resize(map.header().sessions.size());
  const auto is_weak = [&](std::size_t i) { return map.featureCount(i) < config.few_features; };
  const SightGrid all = gridOf(map, [](std::size_t) { return true; });
  result.cells = all.cells();
  std::vector<Step> steps;
  forEachStep(map, [&](std::size_t i, std::optional<std::size_t> before) {
    const TrainingPose pose = map.pose(i);
    SessionSurvey& session = result.sessions[static_cast<std::size_t>(pose.session)];
    addImage(pose, session);
    if (is_weak(i)) ++result.weak_images;
    if (!before) return;
    const double length_m = between_m(map, *before, i);
    session.path_m += length_m;
    steps.push_back({pose.session, *before, i, length_m});
    if (length_m > config.gap_m) {
      ++result.gaps;
    } else {
      addStep(pose, length_m, all, result);
    }
  });
  summarise(steps, config.most_listed, result);
  result.one_way = stretchesOf(map, config.gap_m,
                               [&](std::size_t i) { return !all.oppositeWay(map.position_m(i), map.yaw_rad(i)); });
  const SightGrid sound = gridOf(map, [&](std::size_t i) { return !is_weak(i); });
  result.weak = stretchesOf(map, config.gap_m, is_weak, [&](std::size_t i) {
    return sound.otherSession(map.position_m(i), map.yaw_rad(i), map.pose(i).session);
  });
  return result;
}

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
