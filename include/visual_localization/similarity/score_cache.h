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

  explicit ScoreCache(std::size_t training_images) : entry_of_(training_images) {}

  /// Forgets everything and takes scores from `compare` from now on.
  void startImage(Compare compare);
  /// The score of one training image; throws std::out_of_range for an index beyond the map.
  Score operator[](std::size_t training_image);
  /// Distinct training images compared since startImage.
  std::size_t comparisons() const { return entries_.size(); }

 private:
  struct Entry {
    std::size_t training_image;
    Score score;
  };

  // A sparse set (Briggs and Torczon, 1993): nothing of the size of the map is touched for a new image.
  std::vector<Entry> entries_;           ///< of the current image, in the order of comparison
  std::vector<std::uint32_t> entry_of_;  ///< of each training image; holds if the entry is there and says so too
  Compare compare_;
};

}  // namespace visual_localization
