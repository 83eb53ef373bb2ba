#include "visual_localization/evaluation/best_single_image.h"

#include <algorithm>

#include "visual_localization/evaluation/similarity_row.h"

namespace visual_localization {

Recognition BestSingleImage::update(const std::vector<double>& similarities) {
  requireRow(similarities, training_images_);
  training_images_ = similarities.size();
  const auto best = std::max_element(similarities.begin(), similarities.end());
  return {static_cast<std::size_t>(best - similarities.begin()), *best};
}

}  // namespace visual_localization
