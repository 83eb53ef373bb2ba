#include "visual_localization/localizer/live_image.h"

#include "visual_localization/localizer/stopwatch.h"

namespace visual_localization {

Score LiveImage::compare(FeatureKind kind, std::size_t training_image) {
  const TrainingImage& training = map_.image(training_image);
  if (kind == FeatureKind::kSift) {
    const SiftFeatures& current = front_end_.sift();
    const Stopwatch stopwatch;
    const Score score = sift_.compare(current, training.sift);
    match_ms_ += stopwatch.elapsed_ms();
    return score;
  }
  const GlobalFeatures& current = front_end_.global();
  const Stopwatch stopwatch;
  const Score score = global_.compare(current, training.global);
  match_ms_ += stopwatch.elapsed_ms();
  return score;
}

}  // namespace visual_localization
