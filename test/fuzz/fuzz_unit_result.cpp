/// What an interrupted evaluation left on disk.
#include <cstdint>
#include <stdexcept>
#include <string>

#include "evaluation/unit_result.h"
#include "test/fuzz/fuzz_support.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace visual_localization;
  const std::string text(reinterpret_cast<const char*>(data), size);
  fuzz::expect<std::runtime_error>([&] {
    const std::string written = serialise(parseUnit(text));
    fuzz::mustNotThrow([&] {
      if (serialise(parseUnit(written)) != written) fuzz::fail("results that do not read back");
    });
    fuzz::countRead();
  });
  return 0;
}
