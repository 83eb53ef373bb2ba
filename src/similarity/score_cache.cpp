#include "visual_localization/similarity/score_cache.h"

#include <utility>

namespace visual_localization {

void ScoreCache::startImage(Compare compare) {
  compare_ = std::move(compare);
  ++image_count_;
  comparisons_ = 0;
}

const Score& ScoreCache::operator[](std::size_t training_image) {
  Entry& entry = entries_.at(training_image);
  if (entry.image_count != image_count_) {
    entry.score = compare_(training_image);
    entry.image_count = image_count_;
    ++comparisons_;
  }
  return entry.score;
}

}  // namespace visual_localization
