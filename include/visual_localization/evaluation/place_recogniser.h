#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

namespace visual_localization {

/// Where a place recogniser believes to be.
struct Recognition {
  std::size_t training_image = 0;
  double confidence = 0.0;  ///< the larger the surer; comparable only between images of the same recogniser
};

/// A method beside the papers' trackers: compares every image with the whole map.
class PlaceRecogniser {
 public:
  virtual ~PlaceRecogniser() = default;
  /// The position is unknown again.
  virtual void reset() = 0;
  /// One image further. `similarities`: of the current image to every training image, in the map's order, in [0, 1].
  virtual Recognition update(const std::vector<double>& similarities) = 0;
};

}  // namespace visual_localization
