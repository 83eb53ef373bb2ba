#pragma once

#include <iosfwd>
#include <string>

#include "apps/map_export.h"
#include "survey/map_survey.h"
#include "visual_localization/map/training_map.h"

namespace visual_localization::apps {

/// What a person wants to know about a map before a drive: sessions, coverage, density, headings and where it is weak.
/// `path` is the map's file. However large the map, a few dozen lines.
void printMapReport(std::ostream& out, const std::string& path, const TrainingMap& map, const MapFindings& findings);

}  // namespace visual_localization::apps
