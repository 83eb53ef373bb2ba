#pragma once

#include "visual_localization/features/global_features.h"

namespace visual_localization {

/// Normalised histogram intersection of Weiss et al., Eq. 1: sum of min(q, d) over the sum of q, in [0, 1]; 0 when the
/// query is empty.
double histogramIntersection(const GlobalFeatures::Histogram& query, const GlobalFeatures::Histogram& training);

}  // namespace visual_localization
