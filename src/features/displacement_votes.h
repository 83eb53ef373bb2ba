#pragma once

#include <vector>

#include "visual_localization/features/feature_matcher.h"
#include "visual_localization/features/local_features.h"

namespace visual_localization {

/// Keeps, of `matches` between `a` and `b`, the largest number whose displacements (b minus a) lie in one box of
/// kVoteBoxWidth x kVoteBoxHeight: the picture moved as a whole, as that of a place seen again does and chance does
/// not. Of boxes with equally many the first one found. In order of a. Displacements down the image count in sixteenths
/// of the box.
void keepLargestVote(const LocalFeatures& a, const LocalFeatures& b, double image_width_px,
                     std::vector<FeatureMatch>& matches);

/// Shares of the image's width: 24 x 16 pixels of 640.
constexpr double kVoteBoxWidth = 24.0 / 640.0;
constexpr double kVoteBoxHeight = 16.0 / 640.0;

}  // namespace visual_localization
