#pragma once

#include <cstddef>

#include "visual_localization/features/feature_kind.h"
#include "visual_localization/similarity/score.h"

namespace visual_localization {

/// The current image as the trackers see it: something that can be compared with every training image, by either
/// kind of features. A live one extracts its features when they are first asked for; a recorded one looks the
/// scores up.
class ComparableImage {
 public:
  virtual ~ComparableImage() = default;
  virtual Score compare(FeatureKind kind, std::size_t training_image) = 0;
  /// Number of SIFT features that it is compared by; extracts them if that has not been done.
  virtual std::size_t siftFeatures() = 0;
};

}  // namespace visual_localization
