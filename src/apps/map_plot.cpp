#include <array>
#include <cstddef>
#include <optional>
#include <vector>

#include <nlohmann/json.hpp>

#include "apps/app_support.h"
#include "apps/map_export.h"
#include "base/files.h"
#include "survey/map_survey.h"

namespace visual_localization::apps {
namespace {

using nlohmann::json;

constexpr std::array<FixVerdict, 5> kVerdicts{FixVerdict::kKept, FixVerdict::kNoFix, FixVerdict::kDisordered,
                                              FixVerdict::kSpike, FixVerdict::kMultipath};

json toJson(const Eigen::Vector2d& position_m) { return {position_m.x(), position_m.y()}; }

json toJson(const std::vector<Eigen::Vector2d>& positions_m) {
  json all = json::array();
  for (const Eigen::Vector2d& position_m : positions_m) all.push_back(toJson(position_m));
  return all;
}

/// One without usable coordinates where the robot was.
std::optional<Eigen::Vector2d> positionOf(const Fix& fix, FixVerdict verdict, const Trajectory& path,
                                          const LocalFrame& frame) {
  if (verdict != FixVerdict::kNoFix && isValid(fix.position)) return frame.toEastNorth(fix.position);
  const auto point = path.at(fix.stamp_ns);
  return point ? std::optional<Eigen::Vector2d>(point->position_m) : std::nullopt;
}

json fixesOf(const PlottedSession& session, FixVerdict verdict, const LocalFrame& frame) {
  std::size_t count = 0;
  json positions = json::array();
  for (std::size_t i = 0; i < session.fixes.size(); ++i) {
    if (session.cleaned.verdicts[i] != verdict) continue;
    ++count;
    const auto position_m = positionOf(session.fixes[i], verdict, session.cleaned.trajectory, frame);
    if (position_m) positions.push_back(toJson(*position_m));
  }
  return {{"count", count}, {"positions_m", positions}};
}

/// Nothing between two points where the path was left open.
json pathsOf(const Trajectory& trajectory) {
  const std::vector<TrajectoryPoint>& points = trajectory.points();
  json paths = json::array();
  for (std::size_t i = 0; i < points.size(); ++i) {
    const bool joined =
        i > 0 && trajectory.at(points[i - 1].stamp_ns + (points[i].stamp_ns - points[i - 1].stamp_ns) / 2);
    if (!joined) paths.push_back(json::array());
    paths.back().push_back(toJson(points[i].position_m));
  }
  return paths;
}

json toJson(const PlottedSession& session, const LocalFrame& frame) {
  json fixes;
  for (const FixVerdict verdict : kVerdicts) fixes[toString(verdict)] = fixesOf(session, verdict, frame);
  return {{"name", session.name},
          {"fixes", fixes},
          {"paths_m", pathsOf(session.cleaned.trajectory)},
          {"length_m", session.cleaned.trajectory.length()},
          {"gaps_closed", session.cleaned.gaps_closed},
          {"images_m", toJson(session.images_m)},
          {"landmarks_m", toJson(session.landmarks_m)}};
}

}  // namespace

void addMap(const TrainingMap& map, std::vector<PlottedSession>& sessions) {
  constexpr std::size_t kMostImages = 5000;
  constexpr std::size_t kMostLandmarks = 20000;
  for (std::size_t i = 0; i < map.size(); ++i) {
    sessions.at(static_cast<std::size_t>(map.pose(i).session)).images_m.push_back(map.position_m(i));
  }
  for (const LandmarkPoint& landmark : landmarkPoints(map, kMostImages, kMostLandmarks)) {
    sessions.at(static_cast<std::size_t>(landmark.session)).landmarks_m.emplace_back(landmark.position_m.head<2>());
  }
}

std::string mapPlotJson(const std::vector<PlottedSession>& sessions, const LocalFrame& frame) {
  json all = json::array();
  for (const PlottedSession& session : sessions) all.push_back(toJson(session, frame));
  // A file name need not be UTF-8.
  return json{{"sessions", all}}.dump(-1, ' ', false, json::error_handler_t::replace);
}

void drawMapPlot(const std::string& path, const std::vector<PlottedSession>& sessions, const LocalFrame& frame) {
  PartialFile data(path);  // never committed: disappears at the end, also when the program is interrupted
  data.write(mapPlotJson(sessions, frame));
  runScript("plot_map.py", {data.path(), path});
}

}  // namespace visual_localization::apps
