#pragma once

#include <optional>
#include <string>

#include "survey/ambiguous_places.h"
#include "survey/map_survey.h"
#include "visual_localization/map/training_map.h"

namespace visual_localization::apps {

/// What is known about a map beside what is in it.
struct MapFindings {
  SurveyConfig config;
  MapSurvey survey;
  std::optional<AmbiguousPlaces> ambiguity;  ///< only if it was looked for
};

/// One line an image. `weak` is 1 for few features, `ambiguous` 1 for a place that has a twin; empty: not looked for.
std::string toCsv(const TrainingMap& map, const MapFindings& findings);

/// The path of each session, weak stretches and gaps as lines, the images as points; WGS84.
std::string toGeoJson(const TrainingMap& map, const MapFindings& findings);

}  // namespace visual_localization::apps
