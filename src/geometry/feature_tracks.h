#pragma once

#include <cstdint>
#include <vector>

#include "visual_localization/features/sift_matcher.h"

namespace visual_localization {

/// One thing in the world as an image shows it.
struct FeatureObservation {
  std::uint32_t image = 0;
  std::uint32_t feature = 0;
};

/// The images that show one thing, in their order.
using FeatureTrack = std::vector<FeatureObservation>;

/// Verified matches of two images.
struct ImagePair {
  std::uint32_t a = 0;
  std::uint32_t b = 0;
  std::vector<FeatureMatch> matches;
};

/// Joins matches over many images into tracks of at least `min_views`. A track with two features of one image joins
/// different things: it is dropped. `feature_counts`: of each image. In order of the first observation.
std::vector<FeatureTrack> tracksOf(const std::vector<ImagePair>& pairs, const std::vector<std::size_t>& feature_counts,
                                   std::size_t min_views);

}  // namespace visual_localization
