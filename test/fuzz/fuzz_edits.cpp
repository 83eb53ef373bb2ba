/// Records of use, and areas as GeoJSON.
#include <cstdint>
#include <string>

#include "apps/region.h"
#include "editing/map_selection.h"
#include "test/fuzz/fuzz_support.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace visual_localization;
  const std::string text(reinterpret_cast<const char*>(data), size);
  fuzz::expect<UsageFileError>([&] {
    const MapUsage usage = MapUsage::fromCsv(text);
    const std::string written = usage.toCsv();
    fuzz::mustNotThrow([&] {
      if (MapUsage::fromCsv(written).toCsv() != written) fuzz::fail("a record of use that does not read back");
    });
    if (!usage.empty()) fuzz::countRead();
  });
  fuzz::expect<apps::RegionError>([&] {
    const apps::Region region(text);
    region.contains({48.5, 9.05, 0.0});
    fuzz::countRead();
  });
  return 0;
}
