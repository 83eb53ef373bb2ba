#pragma once

#include <string>

namespace visual_localization {

/// The instructions that vectorised loops use: Highway's name of the best that this processor has ("AVX3_DL", "AVX2",
/// "NEON", ...), or "portable"; the environment variable VISUAL_LOCALIZATION_TARGET (portable, SSE4, AVX2, AVX-512,
/// NEON) forces another. Throws std::invalid_argument when it names what this processor does not have; the best one is
/// in force then.
std::string vectorTarget();

}  // namespace visual_localization
