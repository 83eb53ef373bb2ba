#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "survey/map_survey.h"
#include "visual_localization/map/training_map.h"

/// How map_info writes names, times, lengths and positions.
namespace visual_localization::apps {

/// "name:" as wide as every key of the report.
std::string key(const std::string& name);
/// Of a session, not too long.
std::string nameOf(const TrainingMap& map, int session);
/// When a session was recorded, UTC. The end on the same day needs no date.
std::string spanOf(const SessionSurvey& session);
/// "12.3 m"
std::string metres(double length_m, int decimals = 0);
/// "45 %"
std::string percent(double part, double whole);
/// "(12.3, -4.5)": where an image was taken.
std::string positionText(const TrainingMap& map, std::size_t image);

}  // namespace visual_localization::apps
