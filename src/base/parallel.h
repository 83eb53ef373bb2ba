#pragma once

#include <cstddef>
#include <functional>

#include "visual_localization/base/progress.h"

namespace visual_localization {

/// Runs `task(0)` to `task(count - 1)` on `threads` threads, fewer when the system grants no more, in any order. The
/// first exception of a task ends the work and is thrown again. `progress` is called some times a second.
void parallelFor(std::size_t count, std::size_t threads, const std::function<void(std::size_t)>& task,
                 const Progress& progress = {});

/// The same for tasks that need something of their own in each thread: `task(i, worker)`, where `worker` is below
/// `threads` and no two tasks have the same one at the same time.
void parallelFor(std::size_t count, std::size_t threads,
                 const std::function<void(std::size_t i, std::size_t worker)>& task, const Progress& progress = {});

}  // namespace visual_localization
