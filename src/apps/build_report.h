#pragma once

#include <vector>

#include "apps/command_line.h"
#include "apps/map_plot.h"
#include "visual_localization/geometry/geometry_config.h"
#include "visual_localization/map/map_builder.h"

/// What map_builder says.
namespace visual_localization::apps {

/// Which sessions will be calibrated by their images: nothing moves on the screen meanwhile.
void announceCalibration(const MapBuildReport& report);
/// What was kept of each session, and why the rest was dropped.
void printReport(const MapBuilderOptions& options, const MapBuildReport& report, const GeometryConfig& geometry,
                 const std::vector<PlottedSession>& sessions);
/// In one line. The map must be written.
void printSummary(const MapBuilderOptions& options, const MapBuildReport& report, double seconds);

}  // namespace visual_localization::apps
