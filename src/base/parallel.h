#pragma once

#include <cstddef>
#include <functional>

namespace visual_localization {

/// Called from the calling thread, some times a second.
using ProgressCallback = std::function<void(std::size_t done, std::size_t total)>;

/// Runs `task(0)` to `task(count - 1)` on `threads` threads, fewer when the system grants no more, in any order. The
/// first exception of a task ends the work and is thrown again.
void parallelFor(std::size_t count, std::size_t threads, const std::function<void(std::size_t)>& task,
                 const ProgressCallback& progress = {});

}  // namespace visual_localization
