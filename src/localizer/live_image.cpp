#include "visual_localization/localizer/live_image.h"

#include "visual_localization/localizer/stopwatch.h"

namespace visual_localization {

Score LiveImage::compare(FeatureKind kind, std::size_t training_image) {
  // What the map must read from its file counts as comparing: without the comparison there would be no need.
  if (kind == FeatureKind::kSift) {
    const SiftFeatures& current = front_end_.sift();
    const Stopwatch stopwatch;
    const Score score = sift_.compare(current, *map_.sift(training_image));
    match_ms_ += stopwatch.elapsed_ms();
    return score;
  }
  const GlobalFeatures& current = front_end_.global();
  const Stopwatch stopwatch;
  const Score score = global_.compare(current, *map_.global(training_image));
  match_ms_ += stopwatch.elapsed_ms();
  return score;
}

}  // namespace visual_localization
