#pragma once

#include <string>

namespace visual_localization {

/// The instructions that vectorised loops use on this processor: "AVX2", "NEON", ..., or "portable".
std::string vectorTarget();

}  // namespace visual_localization
