#pragma once

#include <vector>

#include "visual_localization/features/float_plane.h"

namespace visual_localization {

/// Weights of a Gaussian at whole pixels, cut off at four standard deviations; they sum to one.
struct GaussianKernel {
  explicit GaussianKernel(double sigma_px);

  int radius() const { return static_cast<int>(weights.size()) - 1; }
  std::vector<float> weights;  ///< [k] at k pixels from the centre, on either side
};

/// Index `i` of a row of `count` pixels that is continued by its mirror image at both ends, the last pixel not twice.
int mirrored(int i, int count);

/// Separable convolution of planes by strips of rows.
class GaussianBlur {
 public:
  /// Rows [first_row, last_row) of `from` blurred into `to`, which has the same size. Rows of `from` up to the
  /// kernel's radius away are read; beyond its border the image is mirrored.
  void blurRows(const FloatPlane& from, const GaussianKernel& kernel, int first_row, int last_row, FloatPlane& to);

  /// Memory that is kept from call to call.
  struct Workspace {
    AlignedFloats columns;           ///< a strip blurred along its columns, turned: [column][row]
    std::vector<const float*> rows;  ///< those of `from` that a strip reads
  };

 private:
  Workspace work_;
};

}  // namespace visual_localization
