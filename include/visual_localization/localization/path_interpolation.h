#pragma once

#include <cstddef>

#include <Eigen/Core>

#include "visual_localization/localization/scores.h"
#include "visual_localization/map/training_map.h"

namespace visual_localization {

/// Where along the path of a session the current image was taken (east, north; metres): where the median ratio of the
/// sizes of matched features (Score::scale) is 1. That of a training image ahead is below 1, that of one behind above.
/// Begins at `image` and asks its neighbours on that side, a few at most. Without a change of sides there, the position
/// of the image whose ratio is nearest to 1. `scores` must be by local features.
Eigen::Vector2d interpolateOnPath(const TrainingMap& map, Scores& scores, std::size_t image);

}  // namespace visual_localization
