#pragma once

#include <string>

namespace visual_localization {

/// The map file that `path` names when only maps below `directory` may be opened: a relative path begins there, and
/// symbolic links and ".." are followed. Without a directory, the path as it is. Throws MapStoreError, in one line that
/// begins with the path, for a file that lies elsewhere.
std::string mapFileBelow(const std::string& directory, const std::string& path);

}  // namespace visual_localization
