/// A map file that may come from anyone: read as a whole, image by image, and checked.
#include <cstdint>
#include <memory>
#include <string>

#include "test/fuzz/fuzz_support.h"
#include "visual_localization/geometry/sensor_mount.h"
#include "visual_localization/map/map_file.h"

namespace visual_localization {
namespace {

/// Landmarks of features that are there; a camera that looks somewhere.
void requireFitting(const ImageGeometry& geometry, std::size_t features) {
  if (!geometry.camera.ahead().allFinite() || !geometry.covariance.allFinite()) fuzz::fail("a camera is nowhere");
  for (const SeenLandmark& landmark : geometry.landmarks) {
    if (landmark.feature >= features || !landmark.offset_m.allFinite()) fuzz::fail("a landmark that cannot be");
  }
}

/// What a localizer asks a map for.
void use(const TrainingMap& map) {
  constexpr std::size_t kMost = 20;
  for (std::size_t i = 0; i < map.size() && i < kMost; ++i) {
    const TrainingImage image = map.image(i);
    if (map.nearest(image.position_m).image >= map.size()) fuzz::fail("an image that there is not");
    if (image.sift.keypoints().size() != image.sift.size()) fuzz::fail("features do not fit together");
    if (image.geometry) requireFitting(*image.geometry, image.sift.size());
  }
  for (const Session& session : map.header().sessions) {
    if (session.mount) requireMount(*session.mount);
  }
  if (map.geometryCount() > map.size()) fuzz::fail("more images with landmarks than there are");
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
