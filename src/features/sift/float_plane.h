#pragma once

#include <cmath>
#include <cstddef>
#include <vector>

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

}  // namespace visual_localization
