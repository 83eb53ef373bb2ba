#pragma once

#include <string>
#include <vector>

#include "visual_localization/geo/geodetic_point.h"
#include "visual_localization/geo/trajectory_cleaner.h"

namespace visual_localization::apps {

/// The fixes of one round beside what was made of them.
struct PlottedRound {
  std::string name;
  std::vector<Fix> fixes;
  CleanedTrajectory cleaned;
};

/// An SVG picture of the rounds: kept fixes, dropped ones coloured by the reason, the cleaned path and a scale.
std::string plotTrajectories(const std::vector<PlottedRound>& rounds, const LocalFrame& frame);

}  // namespace visual_localization::apps
