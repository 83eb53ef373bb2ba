#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include "visual_localization/geo/geodetic_point.h"
#include "visual_localization/geo/local_frame.h"
#include "visual_localization/geo/trajectory_cleaner.h"
#include "visual_localization/map/training_map.h"

namespace visual_localization::apps {

/// One session: its fixes beside what was made of them.
struct PlottedSession {
  std::string name;
  std::vector<Fix> fixes;
  CleanedTrajectory cleaned;
  std::vector<Eigen::Vector2d> images_m = {};     ///< positions of its training images, adjusted if it has landmarks
  std::vector<Eigen::Vector2d> landmarks_m = {};  ///< none: it has places only
};

/// Gives the sessions, which are those of `map` in its order, their images and landmarks: at most 20000 of these.
void addMap(const TrainingMap& map, std::vector<PlottedSession>& sessions);

/// What plot_map.py draws, as JSON: {"sessions": [{"name", "fixes": {verdict: {"count", "positions_m"}},
/// "paths_m": [[[east, north], ...], ...], "length_m", "gaps_closed", "images_m", "landmarks_m"}, ...]}. A fix without
/// coordinates lies on the path; one beyond its ends has none. A path that was left open has several parts.
std::string mapPlotJson(const std::vector<PlottedSession>& sessions, const LocalFrame& frame);

/// Draws the sessions with plot_map.py into a PNG, SVG or PDF, by the ending of `path`: written whole or not at all.
/// Throws std::runtime_error, in one line.
void drawMapPlot(const std::string& path, const std::vector<PlottedSession>& sessions, const LocalFrame& frame);

}  // namespace visual_localization::apps
