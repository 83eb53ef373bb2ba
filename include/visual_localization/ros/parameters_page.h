#pragma once

#include <string>

namespace visual_localization {

/// doc/parameters.md: every parameter of the localizer and of the map builder, made from their declarations.
std::string parametersPage();

}  // namespace visual_localization
