#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include "visual_localization/similarity/score.h"

namespace visual_localization {

/// Similarities of the current image to the training images, computed when first asked for and then shared by
/// all particles. Counts the comparisons, the papers' measure of cost.
class ScoreCache {
 public:
  using Compare = std::function<Score(std::size_t training_image)>;

  explicit ScoreCache(std::size_t training_images) : entries_(training_images) {}

  /// Forgets everything and takes scores from `compare` from now on.
  void startImage(Compare compare);
  /// The score of one training image; throws std::out_of_range for an index beyond the map.
  const Score& operator[](std::size_t training_image);
  /// Distinct training images compared since startImage.
  std::size_t comparisons() const { return comparisons_; }

 private:
  struct Entry {
    std::uint64_t image_count = 0;  ///< number of the current image for which `score` holds
    Score score;
  };

  std::vector<Entry> entries_;
  Compare compare_;
  std::uint64_t image_count_ = 0;
  std::size_t comparisons_ = 0;
};

}  // namespace visual_localization
