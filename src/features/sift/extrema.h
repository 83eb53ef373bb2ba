#pragma once

#include <optional>
#include <vector>

#include "features/sift/scale_space.h"
#include "visual_localization/features/local_features.h"
#include "visual_localization/features/sift.h"

namespace visual_localization {

/// A sample of an octave's differences that is larger or smaller than its 26 neighbours.
struct SiftExtremum {
  int x = 0;      ///< px of the octave
  int y = 0;      ///< px of the octave
  int level = 0;  ///< of the differences: 1 .. octave_layers
};

/// Finds the extrema of one octave row by row (Lowe 2004, section 3.1). Each row of the differences is computed once
/// and kept as long as its neighbours are searched.
class SiftExtremaSearch {
 public:
  explicit SiftExtremaSearch(const SiftConfig& config);

  /// Starts an octave of this width.
  void begin(int width);
  /// Searches all rows whose neighbours exist when `rows_done` rows of the octave are complete; what it finds is
  /// appended, in order of rows, levels and columns.
  void search(const SiftOctave& octave, int rows_done, std::vector<SiftExtremum>& found);

  /// The differences of the rows that are in use, and how far the search has come.
  struct Workspace {
    int width = 0;
    int levels = 0;            ///< of differences
    float threshold = 0.0F;    ///< weaker samples are no extrema, grey values
    int differences_rows = 0;  ///< rows [0, so many) were computed
    int next_row = 0;          ///< to be searched
    AlignedFloats differences;

    static constexpr int kRows = 4;  ///< kept of each level
    static constexpr std::size_t kMargin = CacheLine::kFloats;
    std::size_t stride() const {
      const auto columns = static_cast<std::size_t>(width) + CacheLine::kFloats - 1;
      return columns / CacheLine::kFloats * CacheLine::kFloats + 2 * kMargin;
    }
    float* row(int level, int y) {
      const auto slot = static_cast<std::size_t>(level) * kRows + static_cast<std::size_t>(y % kRows);
      return differences.data() + slot * stride() + kMargin;
    }
  };

 private:
  Workspace work_;
};

/// A point in scale space that is described once for each of its orientations.
struct SiftPoint {
  int octave = 0;          ///< 0: twice the image's resolution
  int level = 0;           ///< whose gradients describe it: 1 .. octave_layers
  int column = 0;          ///< nearest sample, px of the octave
  int row = 0;             ///< nearest sample, px of the octave
  float x_px = 0.0F;       ///< interpolated, px of the octave
  float y_px = 0.0F;       ///< interpolated, px of the octave
  float sigma_px = 0.0F;   ///< its scale, px of the octave
  float response = 0.0F;   ///< contrast, share of full intensity
  float angle_deg = 0.0F;  ///< [0, 360), clockwise in the image
};

/// Fits a parabola to the differences around an extremum and moves it to the parabola's vertex (Lowe 2004, section 4,
/// Eq. 2 and 3). Nothing when it wanders out of the octave, has little contrast, or lies on an edge (section 4.1).
/// `octave_index` is only noted in the result, whose angle is not set.
std::optional<SiftPoint> refine(const SiftOctave& octave, int octave_index, const SiftExtremum& extremum,
                                const SiftConfig& config);

}  // namespace visual_localization
