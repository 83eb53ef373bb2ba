#pragma once

#include <cmath>
#include <cstddef>

namespace visual_localization::test {

/// Along one axis of the image: in which of the four subimages a pixel is and how much it counts there. Section II of
/// Weiss et al. word by word.
struct PixelPlace {
  PixelPlace(int i, int length_px, double relative_std) {
    const double side_px = length_px / 4.0;
    subimage = static_cast<std::size_t>((i + 0.5) / side_px);
    const double distance_px = i + 0.5 - (static_cast<double>(subimage) + 0.5) * side_px;
    weight = std::exp(-0.5 * std::pow(distance_px / (relative_std * side_px), 2));
  }
  std::size_t subimage = 0;
  double weight = 0.0;
};

}  // namespace visual_localization::test
