#include "visual_localization/similarity/score_cache.h"

#include <utility>

namespace visual_localization {

void ScoreCache::startImage(Compare compare) {
  compare_ = std::move(compare);
  entries_.clear();
}

Score ScoreCache::operator[](std::size_t training_image) {
  std::uint32_t& entry = entry_of_.at(training_image);
  if (entry < entries_.size() && entries_[entry].training_image == training_image) return entries_[entry].score;
  const Score score = compare_(training_image);
  entry = static_cast<std::uint32_t>(entries_.size());
  entries_.push_back({training_image, score});
  return score;
}

}  // namespace visual_localization
