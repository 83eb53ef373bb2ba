#pragma once

#include <optional>
#include <string>

#include "apps/colmap_model.h"
#include "survey/ambiguous_places.h"
#include "survey/landmark_survey.h"
#include "survey/map_survey.h"
#include "visual_localization/map/training_map.h"

namespace visual_localization::apps {

/// What was found out about a map.
struct MapFindings {
  SurveyConfig config;
  MapSurvey survey;
  LandmarkSurvey landmarks;
  std::optional<AmbiguousPlaces> ambiguity;  ///< only if it was checked
};

/// One line per image. `weak` is 1 for few features, `ambiguous` 1 for an image that looks like one far away and empty
/// when that was not checked.
std::string toCsv(const TrainingMap& map, const MapFindings& findings);

/// The path of each session, weak stretches and gaps as lines, the images as points; WGS84.
std::string toGeoJson(const TrainingMap& map, const MapFindings& findings);

/// Writes a COLMAP text model into a folder that is new or empty: a camera for each calibrated session, the images with
/// a geometry as SESSION/STAMP.png, the landmarks as points, in metres of the map frame. Throws std::runtime_error, in
/// one line, when something is in the folder, the map has no landmarks or cannot be read; then it leaves nothing.
ColmapSummary writeColmap(const TrainingMap& map, const std::string& folder);

}  // namespace visual_localization::apps
