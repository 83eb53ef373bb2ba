#include "visual_localization/evaluation/similarity_row.h"

#include <stdexcept>
#include <string>

namespace visual_localization {

void requireRow(const std::vector<double>& similarities, std::size_t training_images) {
  constexpr double kMax = 1.0 + 1e-9;  // histograms that sum to one do so but for rounding
  if (similarities.empty()) throw std::invalid_argument("similarities to no training image at all");
  if (training_images != 0 && similarities.size() != training_images) {
    throw std::invalid_argument("similarities to " + std::to_string(similarities.size()) +
                                " training images after similarities to " + std::to_string(training_images));
  }
  for (std::size_t image = 0; image < similarities.size(); ++image) {
    if (similarities[image] >= 0.0 && similarities[image] <= kMax) continue;
    throw std::invalid_argument("similarity " + std::to_string(similarities[image]) + " to training image " +
                                std::to_string(image) + " is not in [0, 1]");
  }
}

}  // namespace visual_localization
