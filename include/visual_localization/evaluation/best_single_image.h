#pragma once

#include <cstddef>
#include <vector>

#include "visual_localization/evaluation/place_recogniser.h"

namespace visual_localization {

/// Exhaustive search without memory: the training image most similar to the current one, the first of equals.
/// Its similarity is the confidence.
class BestSingleImage final : public PlaceRecogniser {
 public:
  void reset() override {}
  Recognition update(const std::vector<double>& similarities) override;

 private:
  std::size_t training_images_ = 0;  ///< of the first row; later ones must be as long
};

}  // namespace visual_localization
