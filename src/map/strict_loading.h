#pragma once

#include <cstddef>
#include <string>

#include "visual_localization/map/map_file.h"

namespace visual_localization {

/// For a map that is copied image by image: an image that cannot be read is no image without features, since the copy
/// would be wrong without a word. It throws MapStoreError.
inline MapLoading strictLoading(std::size_t cache_bytes) {
  return {cache_bytes, [](const std::string& reason) { throw MapStoreError(reason); }};
}

}  // namespace visual_localization
