#pragma once

#include <cstddef>
#include <functional>
#include <limits>
#include <vector>

#include "visual_localization/localization/particles.h"

namespace visual_localization {

/// Where a lost robot may be: draws training images in proportion to their cheap global similarity to the current
/// image. The whole map is weighed when the first place of an image is asked for; of a map with more than
/// `max_images` every k-th image, beginning with another one for each image, so that k images see all of it; or, when
/// only `max_kept` of its features can be kept in memory, as much of it as that.
class PlaceProposal {
 public:
  /// Weight of a training image for the current image; not negative.
  using Weigh = std::function<double(std::size_t training_image)>;

  /// `training_images` and `max_images` must be positive.
  PlaceProposal(std::size_t training_images, std::size_t max_images,
                std::size_t max_kept = std::numeric_limits<std::size_t>::max());

  /// Forgets everything and takes weights from `weigh` from now on.
  void startImage(Weigh weigh);
  /// A training image; any when nothing has weight.
  std::size_t draw(Random& random);
  /// True once a place of the current image has been drawn.
  bool wasUsed() const { return !cumulated_.empty(); }

 private:
  void weighMap();

  std::size_t training_images_;
  std::size_t stride_;
  std::size_t rounds_;  ///< after so many images it begins with the same training image again
  std::size_t round_ = 0;
  std::size_t first_ = 0;          ///< of the training images that are weighed
  std::vector<double> cumulated_;  ///< weights up to and including each weighed image; empty until needed
  Weigh weigh_;
};

}  // namespace visual_localization
