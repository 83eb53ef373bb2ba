#include "visual_localization/ros/map_directory.h"

#include <algorithm>
#include <filesystem>

#include "visual_localization/io/one_line.h"
#include "visual_localization/map/map_store.h"

namespace visual_localization {
namespace {

namespace fs = std::filesystem;

bool isBelow(const fs::path& directory, const fs::path& file) {
  const auto [in_directory, in_file] = std::mismatch(directory.begin(), directory.end(), file.begin(), file.end());
  return in_directory == directory.end() && in_file != file.end();
}

}  // namespace

std::string mapFileBelow(const std::string& directory, const std::string& path) {
  if (directory.empty()) return path;
  const auto refuse = [&path](const std::string& reason) -> std::string {
    throw MapStoreError(oneLine(path) + ": " + oneLine(reason));
  };
  // The system would read the name only up to a zero.
  if (path.empty() || path.find('\0') != std::string::npos) return refuse("is not the name of a file");
  try {
    const fs::path top = fs::canonical(directory);
    const fs::path file = fs::weakly_canonical(top / path);
    return isBelow(top, file) ? file.string() : refuse("is not below ~map_directory '" + directory + "'");
  } catch (const fs::filesystem_error& error) {
    return refuse("cannot be found below ~map_directory '" + directory + "': " + error.code().message());
  }
}

}  // namespace visual_localization
