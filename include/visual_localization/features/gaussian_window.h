#pragma once

#include "visual_localization/features/float_plane.h"

namespace visual_localization {

/// exp(-distance^2 / (2 sigma^2)) at whole distances on either side of a centre: a Gaussian window over an image is
/// the product of two of them, so no exponential is needed for its pixels.
class GaussianWindow {
 public:
  void set(float sigma_px, int radius);
  /// Readable from -radius on, and a whole vector at any distance up to radius.
  const float* centre() const { return weights_.data() + radius_; }

 private:
  AlignedFloats weights_;
  int radius_ = 0;
};

}  // namespace visual_localization
