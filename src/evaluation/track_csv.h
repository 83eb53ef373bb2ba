#pragma once

#include <string>

#include "visual_localization/localization/estimate.h"

namespace visual_localization {

/// The column names of a track, with line end.
std::string trackCsvHeader();
/// One image of a track in full precision: every value reads back as the same double.
std::string trackCsvRow(const Estimate& estimate);

}  // namespace visual_localization
