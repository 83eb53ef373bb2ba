#pragma once

#include <string>
#include <vector>

#include "visual_localization/parameters/parameters.h"

namespace visual_localization {

/// Names of the presets: sets of parameters of a localizer that belong together.
const std::vector<std::string>& presetNames();

/// The parameters of a preset; those that it does not name stay what they are. Throws ParameterError unless it is one
/// of presetNames().
ParameterValues presetValues(const std::string& name);

}  // namespace visual_localization
