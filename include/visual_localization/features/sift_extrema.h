#pragma once

#include <vector>

#include "visual_localization/features/float_plane.h"
#include "visual_localization/features/sift_extractor.h"
#include "visual_localization/features/sift_scale_space.h"

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

}  // namespace visual_localization
