#pragma once

#include "visual_localization/parameters/parameters.h"

namespace visual_localization {

/// Parameters of earlier versions that nobody set, with the values that they have for good. Files that list all
/// parameters name them still.
const ParameterValues& formerParameters();

}  // namespace visual_localization
