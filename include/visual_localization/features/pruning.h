#pragma once

#include <vector>

#include "visual_localization/features/sift_features.h"

namespace visual_localization {

/// Drops the "noisy" features that appear in one image only (Weiss et al., section III): keeps those of
/// `features` that match (one way, ratio test) a feature of at least one of `neighbours`. The neighbours are
/// given unpruned. Order is kept.
SiftFeatures keepSeenIn(const SiftFeatures& features, const std::vector<const SiftFeatures*>& neighbours,
                        double max_angle_ratio);

}  // namespace visual_localization
