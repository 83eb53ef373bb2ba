#pragma once

#include <string>

namespace visual_localization {

/// The whole content of a file, or of a pipe, which can be read only once. Throws FileError.
std::string readFile(const std::string& path);

}  // namespace visual_localization
