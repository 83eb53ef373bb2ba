#pragma once

#include <vector>

#include "features/sift/float_plane.h"

namespace visual_localization {

/// Weights of a Gaussian at whole pixels, cut off at four standard deviations; they sum to one.
struct GaussianKernel {
  explicit GaussianKernel(double sigma_px);

  int radius() const { return static_cast<int>(weights.size()) - 1; }
  std::vector<float> weights;  ///< [k] at k pixels from the centre, on either side
};

/// Weights of linear interpolation to twice the resolution and then a Gaussian, as one convolution: even pixel 2 i of
/// the result is the sum of weights[radius + k] times pixel i + k, odd pixel 2 i + 1 that of weights[radius - k].
struct DoublingKernel {
  explicit DoublingKernel(double sigma_px);  ///< in pixels of the result

  int radius() const { return static_cast<int>(weights.size()) / 2; }
  std::vector<float> weights;
};

/// How an image goes on beyond its last pixel: its mirror image, which has that pixel again or not.
enum class Mirror { kWithoutLastPixel, kWithLastPixel };

/// Index `i` of a row of `count` pixels that goes on at both ends.
int mirrored(int i, int count, Mirror mirror = Mirror::kWithoutLastPixel);

/// Separable convolution of planes by strips of rows. A strip may overwrite FloatPlane::kSpareRows rows after its last.
class GaussianBlur {
 public:
  /// Rows [first_row, last_row) of `from` blurred into `to`, which has the same size. Rows of `from` up to the
  /// kernel's radius away are read; beyond its border the image is mirrored without its last pixel.
  void blurRows(const FloatPlane& from, const GaussianKernel& kernel, int first_row, int last_row, FloatPlane& to);
  /// The same for `to` twice as wide and high as `from`; first_row must be a multiple of four. Mirrored with the last
  /// pixel: nearly what OpenCV does, which repeats that pixel to double the image and mirrors the result.
  void doubleRows(const FloatPlane& from, const DoublingKernel& kernel, int first_row, int last_row, FloatPlane& to);

  /// Memory that is kept from call to call.
  struct Workspace {
    AlignedFloats columns;           ///< a strip blurred along its columns, turned: [column][row]
    std::vector<const float*> rows;  ///< those of `from` that a strip reads
  };

 private:
  Workspace work_;
};

}  // namespace visual_localization
