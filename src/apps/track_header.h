#pragma once

#include <string>

#include "apps/command_line.h"
#include "visual_localization/localization/localizer.h"

namespace visual_localization::apps {

/// How a track came about, as YAML: version, commit, map with its CRC-32, drive, camera, every parameter. Throws
/// FileError when the map cannot be read.
std::string trackHeader(const LocalizeOptions& options, const LocalizerConfig& config, const Localizer& localizer);

}  // namespace visual_localization::apps
