#pragma once

#include <cstddef>
#include <vector>

#include "geo/fix_nodes.h"

namespace visual_localization {

/// The first fixes behind steps of the receiver's error that no robot drives: the fixes within a second on either side,
/// four or more, differ by more than the receiver promises, than any robot accelerates or late stamps explain, and than
/// eight sigmas of what others do. Slow receivers show none.
std::vector<std::size_t> stepsIn(const UsableFixes& usable);

}  // namespace visual_localization
