#pragma once

#include "visual_localization/features/sift_features.h"

namespace visual_localization {

/// Everything that was extracted from one image; a feature kind that was not asked for is empty.
struct ImageFeatures {
  SiftFeatures sift;
};

}  // namespace visual_localization
