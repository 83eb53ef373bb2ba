/// A map file that may come from anyone: read as a whole, image by image, and checked.
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

#include <sqlite3.h>
#include <unistd.h>

#include "base/time.h"
#include "editing/map_selection.h"
#include "map/map_schema.h"
#include "test/fuzz/fuzz_support.h"
#include "visual_localization/geometry/camera_pose.h"
#include "visual_localization/map/map_file.h"

#if defined(__has_feature)
#if __has_feature(address_sanitizer)
#define VISUAL_LOCALIZATION_PLAIN_SQLITE_MEMORY
extern "C" {
void* __libc_malloc(std::size_t);
void* __libc_realloc(void*, std::size_t);
void __libc_free(void*);
}
#endif
#endif

namespace visual_localization {
namespace {

#ifdef VISUAL_LOCALIZATION_PLAIN_SQLITE_MEMORY
/// SQLite's memory from the C library: from AddressSanitizer it takes most of the time. So what our code
/// reads beyond a blob goes unnoticed here; fuzz_records.cpp reads blobs whose ends are watched. And no locks: nothing
/// here has a second thread.
class PlainSqliteMemory {
 public:
  PlainSqliteMemory() {
    static sqlite3_mem_methods methods{take, give, resize, sizeOf, roundUp, start, end, nullptr};
    if (sqlite3_config(SQLITE_CONFIG_MALLOC, &methods) != SQLITE_OK ||
        sqlite3_config(SQLITE_CONFIG_MEMSTATUS, 0) != SQLITE_OK ||
        sqlite3_config(SQLITE_CONFIG_SINGLETHREAD) != SQLITE_OK) {
      fuzz::fail("SQLite keeps its memory");
    }
  }

 private:
  static constexpr int kHeader = 16;  ///< bytes before each block, for its size
  static void* marked(void* block, int count) {
    if (block == nullptr) return nullptr;
    std::memcpy(block, &count, sizeof(count));
    return static_cast<char*>(block) + kHeader;
  }
  static void* blockOf(void* memory) { return static_cast<char*>(memory) - kHeader; }
  static void* take(int count) { return marked(__libc_malloc(static_cast<std::size_t>(count + kHeader)), count); }
  static void give(void* memory) { __libc_free(blockOf(memory)); }
  static void* resize(void* memory, int count) {
    return marked(__libc_realloc(blockOf(memory), static_cast<std::size_t>(count + kHeader)), count);
  }
  static int sizeOf(void* memory) {
    int count = 0;
    std::memcpy(&count, blockOf(memory), sizeof(count));
    return count;
  }
  static int roundUp(int count) { return (count + 7) / 8 * 8; }
  static int start(void*) { return SQLITE_OK; }
  static void end(void*) {}
};
const PlainSqliteMemory plain_sqlite_memory;
#endif

/// Landmarks of features that are there; a camera that looks somewhere.
void requireFitting(const ImageGeometry& geometry, std::size_t features) {
  if (!geometry.camera.ahead().allFinite() || !geometry.covariance.allFinite()) fuzz::fail("a camera is nowhere");
  for (const SeenLandmark& landmark : geometry.landmarks) {
    if (landmark.feature >= features || !landmark.offset_m.allFinite()) fuzz::fail("a landmark that cannot be");
  }
}

void use(const TrainingMap& map) {
  constexpr std::size_t kMost = 20;
  for (std::size_t i = 0; i < map.size() && i < kMost; ++i) {
    const TrainingImage image = map.image(i);
    if (map.nearest(image.position_m).image >= map.size()) fuzz::fail("an image that there is not");
    if (image.local.keypoints().size() != image.local.size()) fuzz::fail("features do not fit together");
    if (i > 0 && !std::isfinite(secondsBetween(map.pose(i - 1).stamp_ns, image.stamp_ns))) fuzz::fail("no time");
    if (image.geometry) requireFitting(*image.geometry, image.local.size());
  }
  for (const Session& session : map.header().sessions) {
    if (session.mount) requireMount(*session.mount);
  }
  fuzz::countRead();
  if (map.geometryCount() > map.size()) fuzz::fail("more images with landmarks than there are");
  map.nearest(map.area().min_m, 3);
  spaced(map, 5.0);
  if (!map.header().sessions.empty()) withoutSession(map, map.header().sessions.front().name);
}

/// Without features in memory, and for `map_info --check`, it is accepted or refused alike.
void requireTheSame(const std::string& path, bool whole) {
  const bool lazy = fuzz::expect<MapStoreError>([&] { use(*loadMap(path, {0, fuzz::requireOneLine})); });
  if (whole && !lazy) fuzz::fail("the whole map is fine, its places are not");
  const bool checked = fuzz::expect<MapStoreError>([&] { checkMap(path); });
  if (checked && !whole) fuzz::fail("checked and found good, but refused");
  fuzz::expect<MapStoreError>([&] { packageVersionOf(path); });
}

/// What is read can be written, and then it is whole.
void requireWritable(const std::string& path) {
  const std::string copy = path + ".map";
  const auto map = loadMap(path);
  writeSelection(*map, std::vector<bool>(map->size(), true), "keep all", copy);
  checkMap(copy);
  ::unlink(copy.c_str());
}

#ifdef VISUAL_LOCALIZATION_FUZZ
constexpr std::int64_t kOneIn = 32;
#else
constexpr std::int64_t kOneIn = 1;  // files that are read once
#endif

}  // namespace
}  // namespace visual_localization

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace visual_localization;
  const std::string path = fuzz::inMemoryFile(data, size);
  const bool whole = fuzz::expect<MapStoreError>([&] { use(*loadMap(path)); });
  // The other ways take three times as long: for few inputs, always the same ones.
  const std::int64_t number = map_schema::crc32Of({data, size});
  if (number % kOneIn == 0) requireTheSame(path, whole);
  if (whole && number % kOneIn == 0) requireWritable(path);
  return 0;
}
