#pragma once

#include <cstdint>
#include <string>

namespace visual_localization {

/// Which features images are compared by.
enum class FeatureKind : std::uint8_t { kSift = 0, kGlobal = 1 };

/// "SIFT", "GLOBAL".
std::string toString(FeatureKind kind);

}  // namespace visual_localization
