#pragma once

#include <cstddef>
#include <vector>

#include "geo/fix_nodes.h"

namespace visual_localization {

/// The first fixes behind steps of the receiver's error that no robot drives: four fixes or more within a second on
/// either side differ by more than the receiver promises, than any robot accelerates, and than eight sigmas of what
/// others do. Slow receivers show none.
std::vector<std::size_t> stepsIn(const UsableFixes& usable);

}  // namespace visual_localization
