#pragma once

#include <string>
#include <vector>

namespace visual_localization::apps {

/// A line for MapHeader::history: what was done, from which files, by which version of map_edit, and by whom:
/// "merge of north.map, south.map by map_edit 0.2.0, anna@workshop".
std::string provenance(const std::string& command, const std::vector<std::string>& from);

}  // namespace visual_localization::apps
