#pragma once

#include <string>

namespace visual_localization::apps {

/// Has the report of the tables in `folder` and its figures drawn by the script that is installed beside this program.
/// Throws std::runtime_error, in one line, with what the script said last.
void drawReport(const std::string& folder);

}  // namespace visual_localization::apps
