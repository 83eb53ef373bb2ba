#pragma once

#include <cstddef>
#include <vector>

namespace visual_localization {

/// Refuses what no place recogniser can judge: throws std::invalid_argument, naming the value, when a row of
/// similarities is empty, is not as long as the first one (`training_images`; 0 when there was none), or holds a
/// number outside [0, 1], NaN included.
void requireRow(const std::vector<double>& similarities, std::size_t training_images);

}  // namespace visual_localization
