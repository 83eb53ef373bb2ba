#pragma once

#include <cstddef>
#include <functional>

namespace visual_localization {

/// Called while something long is under way, by the thread that started it: `done` of `total` steps are done.
using Progress = std::function<void(std::size_t done, std::size_t total)>;

}  // namespace visual_localization
