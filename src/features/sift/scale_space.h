#pragma once

#include <cmath>
#include <cstddef>
#include <vector>

#include <opencv2/core.hpp>

#include "visual_localization/features/local_features.h"
#include "visual_localization/features/sift.h"

namespace visual_localization {

/// As many bytes as the widest vector has: what starts at one can be loaded by any vector instruction.
struct alignas(64) CacheLine {
  static constexpr std::size_t kFloats = 16;
  float floats[kFloats];
};

/// Floats that start at a cache line. Growing loses what was in them; nothing ever shrinks, so that buffers of
/// this type allocate nothing once they have seen the largest image.
class AlignedFloats {
 public:
  void reserve(std::size_t count) {
    const std::size_t lines = (count + CacheLine::kFloats - 1) / CacheLine::kFloats;
    if (lines > lines_.size()) lines_.resize(lines);
  }
  float* data() { return lines_.data()->floats; }
  const float* data() const { return lines_.data()->floats; }

 private:
  std::vector<CacheLine> lines_;
};

/// A grey image of floats, height x width. Each row starts at a cache line; a whole vector may be read or written
/// at any column of a row, the padding behind the last column means nothing.
class FloatPlane {
 public:
  static constexpr int kSpareRows = 15;  ///< after the last one, which mean nothing either

  void resize(int width, int height) {
    width_ = width;
    height_ = height;
    const auto columns = static_cast<std::size_t>(width);
    stride_ = (columns + 2 * CacheLine::kFloats - 1) / CacheLine::kFloats * CacheLine::kFloats;
    // Rows a multiple of 4 KiB apart would compete for the same lines of the first-level cache.
    constexpr std::size_t kPageFloats = 1024;
    if (stride_ % (kPageFloats / 4) == 0) stride_ += CacheLine::kFloats;
    floats_.reserve(stride_ * static_cast<std::size_t>(height + kSpareRows) + CacheLine::kFloats);
  }

  int width() const { return width_; }
  int height() const { return height_; }
  std::size_t stride() const { return stride_; }
  float* row(int y) { return floats_.data() + static_cast<std::size_t>(y) * stride_; }
  const float* row(int y) const { return floats_.data() + static_cast<std::size_t>(y) * stride_; }

 private:
  int width_ = 0;
  int height_ = 0;
  std::size_t stride_ = 0;
  AlignedFloats floats_;
};

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

inline void GaussianWindow::set(float sigma_px, int radius) {
  radius_ = radius;
  weights_.reserve(static_cast<std::size_t>(2 * radius + 1) + CacheLine::kFloats);
  float* centre = weights_.data() + radius;
  // The quotient of neighbours is itself a geometric sequence.
  const double exponent = -0.5 / (static_cast<double>(sigma_px) * static_cast<double>(sigma_px));
  const double quotient_step = std::exp(2.0 * exponent);
  double quotient = std::exp(exponent);
  double weight = 1.0;
  for (int i = 0; i <= radius; ++i) {
    centre[i] = centre[-i] = static_cast<float>(weight);
    weight *= quotient;
    quotient *= quotient_step;
  }
}

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

/// One octave: the image at octave_layers + 3 blurs, each 2^(1 / octave_layers) times the one before. The differences
/// of neighbours approximate the scale-normalised Laplacian (Lowe 2004, section 3); they are taken where they are
/// needed, not kept.
struct SiftOctave {
  std::vector<FloatPlane> levels;  ///< grey values in [0, 255]

  int width() const { return levels.front().width(); }
  int height() const { return levels.front().height(); }
};

/// The Gaussian pyramid of Lowe 2004, section 3.3: the first octave at twice the image's resolution, each further one
/// at half that of the one before. An octave is made in strips of rows from the first level to the last, so that
/// what a level reads is still in the cache when it is made.
class SiftScaleSpace {
 public:
  static constexpr int kStrip = 16;  ///< rows
  static constexpr int kBorder = 5;  ///< px of an octave in which nothing is searched, as in OpenCV

  explicit SiftScaleSpace(const SiftConfig& config);

  /// A new image (8-bit, one channel): nothing of it is blurred yet.
  void setImage(const cv::Mat& grey);
  /// Octaves worth searching.
  std::size_t octaves() const { return octave_count_; }
  const SiftOctave& octave(std::size_t i) const { return octaves_[i]; }

  /// Starts octave `i`; the ones before must be complete.
  void begin(std::size_t i);
  /// The next strip of all levels. Returns the number of rows that are complete at all levels: the height when the
  /// octave is.
  int advance();

 private:
  void advanceLevel(std::size_t level);

  DoublingKernel first_kernel_;          ///< from the image to the first level
  std::vector<GaussianKernel> kernels_;  ///< from each level to the next
  GaussianBlur blur_;
  FloatPlane grey_;
  std::vector<SiftOctave> octaves_;
  std::size_t octave_count_ = 0;
  std::size_t current_ = 0;
  std::vector<int> rows_done_;  ///< of each level
};

}  // namespace visual_localization
