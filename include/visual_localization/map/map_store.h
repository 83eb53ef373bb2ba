#pragma once

#include <memory>
#include <stdexcept>
#include <string>

#include "visual_localization/map/training_map.h"

namespace visual_localization {

/// A map file that cannot be read or written. The text is one line and begins with the path.
class MapStoreError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Version of the schema that this build writes; the only one it reads.
constexpr int kMapSchemaVersion = 2;

/// Writes `map` to `path` (one SQLite file) in one transaction under a temporary name beside it, then renames:
/// whatever happens, `path` is the old file, the new one, or absent. Throws MapStoreError.
void saveMap(const TrainingMap& map, const std::string& path);

/// Reads and verifies a map: application id, schema version, checksum over everything read, every size and
/// range. The file is opened read-only and its schema is not trusted. Throws MapStoreError.
std::shared_ptr<const TrainingMap> loadMap(const std::string& path);

/// Verifies everything that loadMap() verifies and the structure of the file besides. Throws MapStoreError.
void checkMap(const std::string& path);

/// Version of this package that wrote the map. Throws MapStoreError.
std::string packageVersionOf(const std::string& path);

}  // namespace visual_localization
