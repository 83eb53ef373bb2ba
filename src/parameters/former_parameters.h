#pragma once

#include <map>
#include <string>

namespace visual_localization {

/// Parameters of earlier versions that nobody set, with the values that they have for good. Files that list all
/// parameters name them still.
const std::map<std::string, double>& formerParameters();

}  // namespace visual_localization
