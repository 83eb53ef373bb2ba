#pragma once

#include <vector>

#include "visual_localization/features/sift_features.h"

namespace visual_localization {

/// Drops the "noisy" features that appear in one image only (Weiss et al., section III): keeps those of
/// `features` that match (one way, ratio test) a feature of at least one of `neighbours`. The neighbours are
/// given unpruned. Order is kept.
SiftFeatures keepSeenIn(const SiftFeatures& features, const std::vector<const SiftFeatures*>& neighbours,
                        double max_angle_ratio);

/// The same with one neighbour, into `kept`, whose memory is used again.
void keepSeenIn(const SiftFeatures& features, const SiftFeatures& neighbour, double max_angle_ratio,
                SiftFeatures& kept);

}  // namespace visual_localization
