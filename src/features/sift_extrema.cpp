// Compiled once for each kind of CPU, see nearest_descriptors.cpp.
#define HWY_DISABLED_TARGETS (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128 | HWY_RVV)
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "src/features/sift_extrema.cpp"
#include "visual_localization/features/sift_extrema.h"

#include <algorithm>
#include <cmath>

#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace visual_localization {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;
using Floats = hn::CappedTag<float, CacheLine::kFloats>;
using V = hn::Vec<Floats>;
using M = hn::Mask<Floats>;
constexpr int kLanes = static_cast<int>(hn::MaxLanes(Floats()));

void subtractRow(const SiftOctave& octave, int y, SiftExtremaSearch::Workspace& work) {
  const Floats d;
  for (int level = 0; level < work.levels; ++level) {
    const float* lower = octave.levels[static_cast<std::size_t>(level)].row(y);
    const float* upper = octave.levels[static_cast<std::size_t>(level) + 1].row(y);
    float* out = work.row(level, y);
    for (int x = 0; x < work.width; x += kLanes) {
      hn::Store(hn::Sub(hn::Load(d, upper + x), hn::Load(d, lower + x)), d, out + x);
    }
  }
}

/// Lanes that may still be a maximum or a minimum.
struct Candidates {
  V value;
  M maxima;
  M minima;

  HWY_INLINE void compare(V neighbour) {
    maxima = hn::And(maxima, hn::Ge(value, neighbour));
    minima = hn::And(minima, hn::Le(value, neighbour));
  }
  HWY_INLINE void compareBeside(const float* at) {
    const Floats d;
    compare(hn::LoadU(d, at - 1));
    compare(hn::LoadU(d, at + 1));
  }
  HWY_INLINE void compareThree(const float* at) {
    compare(hn::Load(Floats(), at));
    compareBeside(at);
  }
  HWY_INLINE bool none() const { return hn::AllFalse(Floats(), hn::Or(maxima, minima)); }
};

void keep(const Candidates& candidates, int x, int y, int level, int width, std::vector<SiftExtremum>& found) {
  std::uint8_t bits[8] = {};
  hn::StoreMaskBits(Floats(), hn::Or(candidates.maxima, candidates.minima), bits);
  for (int lane = 0; lane < kLanes; ++lane) {
    if ((bits[lane / 8] >> (lane % 8) & 1) == 0) continue;
    if (x + lane < SiftScaleSpace::kBorder || x + lane >= width - SiftScaleSpace::kBorder) continue;
    found.push_back({x + lane, y, level});
  }
}

void searchRow(int y, int level, SiftExtremaSearch::Workspace& work, std::vector<SiftExtremum>& found) {
  const Floats d;
  const float* rows[3][3];  // [level below, same, above][row above, same, below]
  for (int l = 0; l < 3; ++l) {
    for (int r = 0; r < 3; ++r) rows[l][r] = work.row(level - 1 + l, y - 1 + r);
  }
  const V threshold = hn::Set(d, work.threshold);
  const V negative_threshold = hn::Neg(threshold);
  for (int x = 0; x < work.width; x += kLanes) {
    const V value = hn::Load(d, rows[1][1] + x);
    Candidates candidates{value, hn::Gt(value, threshold), hn::Lt(value, negative_threshold)};
    candidates.compare(hn::Load(d, rows[1][0] + x));
    candidates.compare(hn::Load(d, rows[1][2] + x));
    candidates.compare(hn::Load(d, rows[0][1] + x));
    candidates.compare(hn::Load(d, rows[2][1] + x));
    if (candidates.none()) continue;
    candidates.compareBeside(rows[1][1] + x);
    if (candidates.none()) continue;
    candidates.compareBeside(rows[1][0] + x);
    candidates.compareBeside(rows[1][2] + x);
    for (const int l : {0, 2}) {
      candidates.compareBeside(rows[l][1] + x);
      candidates.compareThree(rows[l][0] + x);
      candidates.compareThree(rows[l][2] + x);
      if (candidates.none()) break;
    }
    if (!candidates.none()) keep(candidates, x, y, level, work.width, found);
  }
}

void searchImpl(const SiftOctave& octave, int rows_done, SiftExtremaSearch::Workspace& work,
                std::vector<SiftExtremum>& found) {
  const int last = std::min(rows_done - 1, octave.height() - SiftScaleSpace::kBorder);
  for (; work.next_row < last; ++work.next_row) {
    for (; work.differences_rows <= work.next_row + 1; ++work.differences_rows) {
      subtractRow(octave, work.differences_rows, work);
    }
    for (int level = 1; level + 1 < work.levels; ++level) searchRow(work.next_row, level, work, found);
  }
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace visual_localization
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace visual_localization {

HWY_EXPORT(searchImpl);

SiftExtremaSearch::SiftExtremaSearch(const SiftConfig& config) {
  work_.levels = config.octave_layers + 2;
  // Half of the threshold for interpolated extrema, which are stronger; in whole grey values, as in OpenCV.
  constexpr double kShare = 0.5;
  work_.threshold = static_cast<float>(std::floor(kShare * config.contrast_threshold / config.octave_layers * 255.0));
}

void SiftExtremaSearch::begin(int width) {
  work_.width = width;
  work_.next_row = SiftScaleSpace::kBorder;
  work_.differences_rows = SiftScaleSpace::kBorder - 1;
  work_.differences.reserve(work_.stride() * static_cast<std::size_t>(work_.levels * Workspace::kRows));
}

void SiftExtremaSearch::search(const SiftOctave& octave, int rows_done, std::vector<SiftExtremum>& found) {
  HWY_DYNAMIC_DISPATCH(searchImpl)(octave, rows_done, work_, found);
}

}  // namespace visual_localization
#endif
