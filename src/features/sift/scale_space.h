#pragma once

#include <cstddef>
#include <vector>

#include <opencv2/core.hpp>

#include "features/sift/float_plane.h"
#include "features/sift/gaussian_blur.h"
#include "visual_localization/features/sift_extractor.h"

namespace visual_localization {

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
