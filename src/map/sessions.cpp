#include "map/sessions.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

#include <Eigen/Geometry>
#include <GeographicLib/Geodesic.hpp>

#include "base/statistics.h"
#include "visual_localization/map/map_builder.h"

namespace visual_localization {
namespace {

GeodeticPoint datumAt(const GeodeticPoint& position) {
  GeodeticPoint datum = position;
  if (!std::isfinite(datum.altitude_m)) datum.altitude_m = 0.0;
  return datum;
}

/// The middle of all valid fixes, axis by axis: unlike the first one it cannot be an outlier far away.
GeodeticPoint middleOf(const std::vector<Fix>& fixes) {
  std::vector<double> latitudes;
  std::vector<double> longitudes;
  for (const Fix& fix : fixes) {
    if (!hasPosition(fix)) continue;
    latitudes.push_back(fix.position.latitude_deg);
    longitudes.push_back(fix.position.longitude_deg);
  }
  if (latitudes.empty()) {
    throw std::runtime_error("none of its " + std::to_string(fixes.size()) +
                             " fixes is valid (latitude 0, longitude 0 is none)");
  }
  return {upperMedian(latitudes), upperMedian(longitudes), 0.0};
}

}  // namespace

LocalFrame frameFor(const std::vector<Fix>& fixes, const TrajectoryCleanerConfig& config) {
  const LocalFrame provisional(middleOf(fixes));
  const CleanedTrajectory cleaned = cleanTrajectory(fixes, provisional, config);
  const auto first = std::find(cleaned.verdicts.begin(), cleaned.verdicts.end(), FixVerdict::kKept);
  if (first == cleaned.verdicts.end()) throw std::runtime_error("none of its fixes is believable");
  return LocalFrame(datumAt(fixes[static_cast<std::size_t>(first - cleaned.verdicts.begin())].position));
}

double distanceBetween_m(const GeodeticPoint& a, const GeodeticPoint& b) {
  double distance_m = 0.0;
  GeographicLib::Geodesic::WGS84().Inverse(a.latitude_deg, a.longitude_deg, b.latitude_deg, b.longitude_deg,
                                           distance_m);
  return distance_m;
}

void requireNear(const std::vector<Fix>& fixes, const GeodeticPoint& datum) {
  const double distance_m = distanceBetween_m(datum, middleOf(fixes));
  if (distance_m <= kFarthestSession_m) return;
  throw std::runtime_error("is " + std::to_string(std::llround(1e-3 * distance_m)) +
                           " km away from where the map begins, and one map reaches " +
                           std::to_string(std::llround(1e-3 * kFarthestSession_m)) + " km: build two maps");
}

void requireMotion(const CleanedTrajectory& cleaned) {
  Eigen::AlignedBox2d box;
  for (const TrajectoryPoint& point : cleaned.trajectory.points()) box.extend(point.position_m);
  if (box.diagonal().norm() >= kSmallestSession_m) return;
  const auto kept = std::count(cleaned.verdicts.begin(), cleaned.verdicts.end(), FixVerdict::kKept);
  throw std::runtime_error("its " + std::to_string(kept) + " believable fixes of " +
                           std::to_string(cleaned.verdicts.size()) + " are all at one point: the receiver was " +
                           "stuck, or the robot stood; a session spans at least 0.1 m");
}

std::vector<MapFix> inFrame(const std::vector<Fix>& fixes, const LocalFrame& frame) {
  std::vector<MapFix> found;
  for (const Fix& fix : fixes) {
    if (!hasPosition(fix)) continue;
    const double up_m = fix.position.altitude_m - frame.datum().altitude_m;
    found.push_back({fix.stamp_ns, frame.toEastNorth(fix.position), fix.sigma_m, up_m, fix.sigma_up_m});
  }
  std::stable_sort(found.begin(), found.end(),
                   [](const MapFix& a, const MapFix& b) { return a.stamp_ns < b.stamp_ns; });
  return found;
}

SessionIndex::SessionIndex(const TrainingMap& map) : sessions_(map.header().sessions.size()) {
  std::vector<std::vector<Eigen::Vector2d>> positions_m(sessions_.size());
  for (std::size_t i = 0; i < map.size(); ++i) {
    const auto session = static_cast<std::size_t>(map.pose(i).session);
    sessions_[session].images.push_back(i);
    positions_m[session].push_back(map.position_m(i));
  }
  for (std::size_t s = 0; s < sessions_.size(); ++s) {
    if (!positions_m[s].empty()) sessions_[s].index = std::make_unique<PositionIndex>(std::move(positions_m[s]));
  }
}

Neighbour SessionIndex::nearest(std::size_t session, const Eigen::Vector2d& position_m) const {
  const Neighbour found = sessions_[session].index->nearest(position_m);
  return {sessions_[session].images[found.image], found.distance_m};
}

void SessionIndex::nearest(std::size_t session, const Eigen::Vector2d& position_m, const PositionIndex::Search& search,
                           const std::function<bool(std::size_t image)>& accept, std::vector<Neighbour>& found) const {
  found.clear();
  if (!has(session)) return;
  const std::vector<std::size_t>& images = sessions_[session].images;
  sessions_[session].index->nearest(
      position_m, search, [&](std::size_t i) { return accept(images[i]); }, found);
  for (Neighbour& neighbour : found) neighbour.image = images[neighbour.image];
}

}  // namespace visual_localization
