#pragma once

#include <cmath>
#include <cstdint>

namespace visual_localization::test {

inline constexpr std::int64_t kSecond_ns = 1'000'000'000;

inline std::int64_t ns(double seconds) { return static_cast<std::int64_t>(std::llround(seconds * 1e9)); }

}  // namespace visual_localization::test
