#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <ostream>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "survey/map_survey.h"
#include "visual_localization/geo/trajectory.h"
#include "visual_localization/geo/trajectory_cleaner.h"
#include "visual_localization/map/training_map.h"

namespace visual_localization::apps {

/// What was found out about a map.
struct MapFindings {
  SurveyConfig config;
  MapSurvey survey;
  LandmarkSurvey landmarks;
  std::vector<ErrorStretch> errors;
  std::optional<AmbiguousPlaces> ambiguity;  ///< only if it was checked
};

/// Sessions, coverage, density, headings and where the map is weak: a few dozen lines, however large the map. `path` is
/// the map's file.
void printMapReport(std::ostream& out, const std::string& path, const TrainingMap& map, const MapFindings& findings);

/// Takes one piece of a text after the other.
using TextSink = std::function<void(const std::string&)>;

/// One line per image. `weak` is 1 for few features, `ambiguous` 1 for an image that looks like one far away, empty
/// when not checked.
void writeCsv(const TrainingMap& map, const MapFindings& findings, const TextSink& write);

/// Paths, weak stretches and gaps as lines, images as points; WGS84.
void writeGeoJson(const TrainingMap& map, const MapFindings& findings, const TextSink& write);

/// What the builder has to say of a recording, in one line.
struct Remark {
  std::string text;
  bool disagrees = false;  ///< parts of the recording contradict each other, and the map may be wrong
};

/// One session: its fixes beside what was made of them.
struct PlottedSession {
  std::string name;
  std::vector<Fix> fixes;
  CleanedTrajectory cleaned;
  std::vector<Eigen::Vector2d> images_m = {};     ///< positions of its training images, adjusted if it has landmarks
  std::vector<Eigen::Vector2d> landmarks_m = {};  ///< none: it has places only
  std::vector<Remark> remarks = {};
};

/// Sessions are those of `map` in its order; at most 20000 landmarks.
void addMap(const TrainingMap& map, std::vector<PlottedSession>& sessions);

/// JSON for plot_map.py: {"sessions": [{"name", "fixes": {verdict: {"count", "positions_m"}}, "paths_m": [[[east,
/// north], ...], ...], "length_m", "gaps_closed", "images_m", "landmarks_m"}, ...]}. A fix without coordinates lies on
/// the path; one beyond its ends has none.
std::string mapPlotJson(const std::vector<PlottedSession>& sessions, const LocalFrame& frame);

/// PNG, SVG or PDF by the ending of `path`, whole or not at all. Throws std::runtime_error, in one line.
void drawMapPlot(const std::string& path, const std::vector<PlottedSession>& sessions, const LocalFrame& frame);

}  // namespace visual_localization::apps
