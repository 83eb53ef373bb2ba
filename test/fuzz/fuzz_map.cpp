/// A map file that may come from anyone: read as a whole, image by image, and checked.
#include <cstdint>
#include <memory>
#include <string>

#include "test/fuzz/fuzz_support.h"
#include "visual_localization/map/map_file.h"

namespace visual_localization {
namespace {

/// What a localizer asks a map for.
void use(const TrainingMap& map) {
  constexpr std::size_t kMost = 20;
  for (std::size_t i = 0; i < map.size() && i < kMost; ++i) {
    const TrainingImage image = map.image(i);
    if (map.nearest(image.position_m).image >= map.size()) fuzz::fail("an image that there is not");
    if (image.sift.keypoints().size() != image.sift.size()) fuzz::fail("features do not fit together");
  }
  map.nearest(map.area().min_m, 3);
}

}  // namespace
}  // namespace visual_localization

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace visual_localization;
  const std::string path = fuzz::inMemoryFile(data, size);
  const bool whole = fuzz::expect<MapStoreError>([&] { use(*loadMap(path)); });
  const bool lazy = fuzz::expect<MapStoreError>([&] { use(*loadMap(path, {0, fuzz::requireOneLine})); });
  if (whole && !lazy) fuzz::fail("the whole map is fine, its places are not");
  const bool checked = fuzz::expect<MapStoreError>([&] { checkMap(path); });
  if (checked && !whole) fuzz::fail("checked and found good, but refused");
  fuzz::expect<MapStoreError>([&] { originOf(path); });
  return 0;
}
