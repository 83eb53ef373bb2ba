#pragma once

#include <cstddef>
#include <functional>
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

/// Version of the schema: the only one that this build reads and writes.
constexpr int kMapSchemaVersion = 10;

/// Megabytes (2^20 bytes) of features that are kept in memory unless someone says otherwise.
constexpr int kDefaultMapCache_mb = 256;

/// How a map is opened.
struct MapLoading {
  /// A file that is not larger than this is read into memory and verified as a whole. Of a larger one only the poses
  /// are read at once; features are read when they are first needed, verified then, and kept up to this limit.
  std::size_t cache_bytes = std::size_t{kDefaultMapCache_mb} << 20U;
  /// Called once, with one line, when features of an open map cannot be read; by the thread that needs them.
  std::function<void(const std::string&)> warn = {};
};

/// Writes `map` to `path` (one SQLite file) in one transaction under a temporary name beside it, then renames:
/// whatever happens, `path` is the old file, the new one, or absent. Throws MapStoreError.
void saveMap(const TrainingMap& map, const std::string& path);

/// Reads and verifies a map: application id, schema version, checksum over everything read, every size and
/// range. The file is opened read-only and its schema is not trusted. Throws MapStoreError. An open map survives
/// whatever happens to its file: see TrainingMap::local.
std::shared_ptr<const TrainingMap> loadMap(const std::string& path, const MapLoading& loading = {});

/// Verifies all that loadMap() verifies, everything that an image looked like, and the structure of the file, image by
/// image: in little memory, however large the map is. Throws MapStoreError.
void checkMap(const std::string& path);

/// Version of the package that wrote a map. Throws MapStoreError.
std::string packageVersionOf(const std::string& path);

}  // namespace visual_localization
