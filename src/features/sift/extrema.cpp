// Compiled once for each kind of CPU, see highway.h.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "features/sift/extrema.cpp"
#include "features/sift/extrema.h"

#include <algorithm>
#include <cmath>

#include "features/highway.h"
#include "visual_localization/features/sift.h"

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
namespace {

constexpr float kIntensity = 1.0F / 255.0F;  ///< of one grey value
constexpr int kMostSteps = 5;

struct Vector {
  float x;
  float y;
  float s;  ///< along the scale

  float dot(const Vector& other) const { return x * other.x + y * other.y + s * other.s; }
  bool isWithin(float limit) const { return std::abs(x) < limit && std::abs(y) < limit && std::abs(s) < limit; }
};

/// Value and derivatives of the differences at a sample, as shares of full intensity.
struct Differences {
  float value;
  Vector gradient;
  float xx, yy, ss, xy, xs, ys;
};

/// The 3 x 3 samples of one level of the differences around a column and row.
struct Neighbourhood {
  float at[3][3];

  Neighbourhood(const SiftOctave& octave, int level, int column, int row) {
    for (int r = 0; r < 3; ++r) {
      const float* lower = octave.levels[static_cast<std::size_t>(level)].row(row - 1 + r) + column - 1;
      const float* upper = octave.levels[static_cast<std::size_t>(level) + 1].row(row - 1 + r) + column - 1;
      for (int c = 0; c < 3; ++c) at[r][c] = (upper[c] - lower[c]) * kIntensity;
    }
  }
};

Differences differencesAt(const SiftOctave& octave, const SiftExtremum& at) {
  const Neighbourhood below(octave, at.level - 1, at.x, at.y);
  const Neighbourhood here(octave, at.level, at.x, at.y);
  const Neighbourhood above(octave, at.level + 1, at.x, at.y);
  const auto& b = below.at;
  const auto& h = here.at;
  const auto& a = above.at;
  const float value = h[1][1];
  return {value,
          {0.5F * (h[1][2] - h[1][0]), 0.5F * (h[2][1] - h[0][1]), 0.5F * (a[1][1] - b[1][1])},
          h[1][2] + h[1][0] - 2.0F * value,
          h[2][1] + h[0][1] - 2.0F * value,
          a[1][1] + b[1][1] - 2.0F * value,
          0.25F * (h[2][2] - h[2][0] - h[0][2] + h[0][0]),
          0.25F * (a[1][2] - a[1][0] - b[1][2] + b[1][0]),
          0.25F * (a[2][1] - a[0][1] - b[2][1] + b[0][1])};
}

/// Offset from the sample to the vertex of the parabola: minus the inverse Hessian times the gradient (Eq. 3). Zero
/// when there is no single vertex.
Vector vertexOf(const Differences& d) {
  const float c_xx = d.yy * d.ss - d.ys * d.ys;
  const float c_xy = d.xs * d.ys - d.xy * d.ss;
  const float c_xs = d.xy * d.ys - d.xs * d.yy;
  const float c_yy = d.xx * d.ss - d.xs * d.xs;
  const float c_ys = d.xy * d.xs - d.xx * d.ys;
  const float c_ss = d.xx * d.yy - d.xy * d.xy;
  const float determinant = d.xx * c_xx + d.xy * c_xy + d.xs * c_xs;
  if (determinant == 0.0F) return {0.0F, 0.0F, 0.0F};
  const float scale = -1.0F / determinant;
  const Vector& g = d.gradient;
  return {scale * (c_xx * g.x + c_xy * g.y + c_xs * g.s), scale * (c_xy * g.x + c_yy * g.y + c_ys * g.s),
          scale * (c_xs * g.x + c_ys * g.y + c_ss * g.s)};
}

bool isInside(const SiftOctave& octave, const SiftExtremum& at, int layers) {
  constexpr int kBorder = SiftScaleSpace::kBorder;
  return at.level >= 1 && at.level <= layers && at.x >= kBorder && at.x < octave.width() - kBorder && at.y >= kBorder &&
         at.y < octave.height() - kBorder;
}

/// Section 4.1, Eq. 4: the ratio of the principal curvatures is too large.
bool isOnEdge(const Differences& d, float threshold) {
  const float trace = d.xx + d.yy;
  const float determinant = d.xx * d.yy - d.xy * d.xy;
  return determinant <= 0.0F || trace * trace * threshold >= (threshold + 1.0F) * (threshold + 1.0F) * determinant;
}

}  // namespace

HWY_EXPORT(searchImpl);

SiftExtremaSearch::SiftExtremaSearch(const SiftConfig& config) {
  work_.levels = config.octave_layers + 2;
  // Half of the threshold for interpolated extrema, which are stronger; in whole grey values, as in OpenCV, unless that
  // is none: every pixel of a blank wall would be a candidate.
  constexpr double kShare = 0.5;
  const double grey_values = kShare * config.contrast_threshold / config.octave_layers * 255.0;
  work_.threshold = static_cast<float>(grey_values < 1.0 ? grey_values : std::floor(grey_values));
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

std::optional<SiftPoint> refine(const SiftOctave& octave, int octave_index, const SiftExtremum& extremum,
                                const SiftConfig& config) {
  constexpr float kHalfSample = 0.5F;
  constexpr float kFarAway = 1e6F;
  SiftExtremum at = extremum;
  for (int step = 0; step < kMostSteps; ++step) {
    const Differences differences = differencesAt(octave, at);
    const Vector offset = vertexOf(differences);
    if (!offset.isWithin(kHalfSample)) {
      if (!offset.isWithin(kFarAway)) return std::nullopt;
      at.x += static_cast<int>(std::lrint(offset.x));
      at.y += static_cast<int>(std::lrint(offset.y));
      at.level += static_cast<int>(std::lrint(offset.s));
      if (!isInside(octave, at, config.octave_layers)) return std::nullopt;
      continue;
    }
    const float contrast = differences.value + 0.5F * differences.gradient.dot(offset);
    const float layers = static_cast<float>(config.octave_layers);
    if (std::abs(contrast) * layers < static_cast<float>(config.contrast_threshold)) return std::nullopt;
    if (isOnEdge(differences, static_cast<float>(config.edge_threshold))) return std::nullopt;
    SiftPoint point;
    point.octave = octave_index;
    point.level = at.level;
    point.column = at.x;
    point.row = at.y;
    point.x_px = static_cast<float>(at.x) + offset.x;
    point.y_px = static_cast<float>(at.y) + offset.y;
    point.sigma_px =
        static_cast<float>(config.sigma_px) * std::exp2((static_cast<float>(at.level) + offset.s) / layers);
    point.response = std::abs(contrast);
    return point;
  }
  return std::nullopt;
}

}  // namespace visual_localization
#endif
