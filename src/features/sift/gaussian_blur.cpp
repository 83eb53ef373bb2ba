// Compiled once for each kind of CPU, see highway.h.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "features/sift/gaussian_blur.cpp"
#include <algorithm>
#include <cmath>
#include <cstddef>

#include "features/highway.h"
#include "features/sift/scale_space.h"
#include "features/sift/vectors-inl.h"

HWY_BEFORE_NAMESPACE();
namespace visual_localization {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;
using Floats = hn::CappedTag<float, CacheLine::kFloats>;
using V = hn::Vec<Floats>;
constexpr int kLanes = static_cast<int>(hn::MaxLanes(Floats()));

/// Symmetric convolution of a line of inputs (a column of pixels, or a row of columns) into four neighbouring results.
/// `at(i)` loads input i; result j has its centre at input radius + j. Inputs at equal distance are added first, so
/// there is one multiplication for the two, and the results share their inputs: two loads a weight. `Fixed`: the
/// radius if it is known when compiling, so that all weights are unrolled; otherwise 0.
template <int Fixed>
struct Symmetric {
  static constexpr int kInputs = 4;  ///< from one four of results to the next
  const float* weights;
  int any_radius;

  HWY_INLINE int radius() const { return Fixed > 0 ? Fixed : any_radius; }

  template <class At>
  HWY_INLINE void four(const At& at, V& s0, V& s1, V& s2, V& s3) const {
    const int r = radius();
    s0 = s1 = s2 = s3 = hn::Zero(Floats());
    const V a0 = at(0), a1 = at(1), a2 = at(2), a3 = at(3);
    const V b0 = at(2 * r), b1 = at(2 * r + 1), b2 = at(2 * r + 2), b3 = at(2 * r + 3);
    if constexpr (Fixed > 0) {
      unrolled<Fixed>(at, a0, a1, a2, a3, b0, b1, b2, b3, s0, s1, s2, s3);
    } else {
      looped(at, a0, a1, a2, a3, b0, b1, b2, b3, s0, s1, s2, s3);
    }
  }

 private:
  HWY_INLINE void add(int k, V i0, V i1, V i2, V i3, V& s0, V& s1, V& s2, V& s3) const {
    const V weight = hn::Set(Floats(), weights[k]);
    s0 = hn::MulAdd(weight, i0, s0);
    s1 = hn::MulAdd(weight, i1, s1);
    s2 = hn::MulAdd(weight, i2, s2);
    s3 = hn::MulAdd(weight, i3, s3);
  }

  /// The inputs at a distance below (a) and above (b) the four centres, then those nearer.
  template <int Distance, class At>
  HWY_INLINE void unrolled(const At& at, V a0, V a1, V a2, V a3, V b0, V b1, V b2, V b3, V& s0, V& s1, V& s2,
                           V& s3) const {
    if constexpr (Distance > 0) {
      add(Distance, hn::Add(a0, b0), hn::Add(a1, b1), hn::Add(a2, b2), hn::Add(a3, b3), s0, s1, s2, s3);
      unrolled<Distance - 1>(at, a1, a2, a3, at(Fixed - Distance + 4), at(Fixed + Distance - 1), b0, b1, b2, s0, s1, s2,
                             s3);
    } else {
      add(0, a0, a1, a2, a3, s0, s1, s2, s3);
    }
  }

  template <class At>
  HWY_INLINE void looped(const At& at, V a0, V a1, V a2, V a3, V b0, V b1, V b2, V b3, V& s0, V& s1, V& s2,
                         V& s3) const {
    const int r = radius();
    for (int k = r; k > 0; --k) {
      add(k, hn::Add(a0, b0), hn::Add(a1, b1), hn::Add(a2, b2), hn::Add(a3, b3), s0, s1, s2, s3);
      a0 = a1, a1 = a2, a2 = a3, a3 = at(r - k + 4);
      b3 = b2, b2 = b1, b1 = b0, b0 = at(r + k - 1);
    }
    add(0, a0, a1, a2, a3, s0, s1, s2, s3);
  }
};

/// Interpolation to twice the resolution and convolution in one: two results between the same inputs have the same
/// weights in opposite order.
struct Doubling {
  static constexpr int kInputs = 2;
  const float* weights;  ///< 2 * radius + 1
  int any_radius;

  HWY_INLINE int radius() const { return any_radius; }

  template <class At>
  HWY_INLINE void four(const At& at, V& s0, V& s1, V& s2, V& s3) const {
    const Floats d;
    s0 = s1 = s2 = s3 = hn::Zero(d);
    V here = at(0);
    for (int i = 0; i <= 2 * any_radius; ++i) {
      const V next = at(i + 1);
      const V even = hn::Set(d, weights[i]);
      const V odd = hn::Set(d, weights[2 * any_radius - i]);
      s0 = hn::MulAdd(even, here, s0);
      s1 = hn::MulAdd(odd, here, s1);
      s2 = hn::MulAdd(even, next, s2);
      s3 = hn::MulAdd(odd, next, s3);
      here = next;
    }
  }
};

#if HWY_TARGET == HWY_SCALAR
constexpr int kStrip = 4;  ///< rows that are blurred together
#else
constexpr int kStrip = kLanes;
#endif

/// Four results of a line at a time, and the block that they make turned: columns of kStrip pixels become rows.
template <class Four, class Use>
HWY_INLINE void turned(const Four& four, const Use& use) {
#if HWY_TARGET == HWY_SCALAR
  V s0, s1, s2, s3;
  four(0, s0, s1, s2, s3);
  use(0, s0), use(1, s1), use(2, s2), use(3, s3);
#else
  Transpose<Floats> block;
  for (int group = 0; group < kLanes / 4; ++group) {
    V s0, s1, s2, s3;
    four(group, s0, s1, s2, s3);
    block.put(group, s0, s1, s2, s3);
  }
  block.take(use);
#endif
}

/// Column `i` of a turned strip.
template <class Float>
HWY_INLINE Float* columnAt(Float* columns, int i) {
  return columns + static_cast<std::ptrdiff_t>(i) * kStrip;
}

/// A strip of kStrip rows, convolved along its columns, into work.columns from column `radius` on, where each column
/// is kStrip floats.
template <class Filter>
void alongColumns(const Filter& filter, int width, GaussianBlur::Workspace& work) {
  const Floats d;
  float* to = columnAt(work.columns.data(), filter.radius());
  for (int x = 0; x < width; x += kLanes) {
    turned(
        [&](int group, V& s0, V& s1, V& s2, V& s3) {
          const float* const* rows = work.rows.data() + Filter::kInputs * group;
          filter.four([&](int i) { return hn::Load(d, rows[i] + x); }, s0, s1, s2, s3);
        },
        [&](int i, V column) { hn::Store(column, d, columnAt(to, x) + static_cast<std::ptrdiff_t>(i) * kLanes); });
  }
}

/// The turned strip convolved along its rows, into kStrip rows of `to`.
template <class Filter>
void alongRows(const Filter& filter, const GaussianBlur::Workspace& work, int first_row, FloatPlane& to) {
  const Floats d;
  const std::size_t stride = to.stride();
  for (int x = 0; x < to.width(); x += kStrip) {
    float* out = to.row(first_row) + x;
#if HWY_TARGET == HWY_SCALAR
    for (int row = 0; row < kStrip; ++row) {
      const float* columns = columnAt(work.columns.data(), x / 4 * Filter::kInputs) + row;
      V s0, s1, s2, s3;
      filter.four([&](int i) { return hn::Load(d, columnAt(columns, i)); }, s0, s1, s2, s3);
      float* at = out + static_cast<std::size_t>(row) * stride;
      hn::Store(s0, d, at), hn::Store(s1, d, at + 1), hn::Store(s2, d, at + 2), hn::Store(s3, d, at + 3);
    }
#else
    turned(
        [&](int group, V& s0, V& s1, V& s2, V& s3) {
          const float* columns = columnAt(work.columns.data(), (x / 4 + group) * Filter::kInputs);
          filter.four([&](int i) { return hn::Load(d, columnAt(columns, i)); }, s0, s1, s2, s3);
        },
        [&](int i, V row) { hn::Store(row, d, out + static_cast<std::size_t>(i) * stride); });
#endif
  }
}

/// Continues the columns at both ends.
void mirrorColumns(int width, int radius, Mirror mirror, float* columns) {
  float* first = columnAt(columns, radius);
  const auto copy = [first](int from, int to) { std::copy_n(columnAt(first, from), kStrip, columnAt(first, to)); };
  for (int i = 1; i <= radius; ++i) {
    copy(mirrored(-i, width, mirror), -i);
    copy(mirrored(width - 1 + i, width, mirror), width - 1 + i);
  }
}

/// Rows [first_row, last_row) of `to`, four for every kInputs of `from`.
template <class Filter>
void convolve(const Filter& filter, const FloatPlane& from, Mirror mirror, int first_row, int last_row,
              GaussianBlur::Workspace& work, FloatPlane& to) {
  const int radius = filter.radius();
  const int inputs = kStrip / 4 * Filter::kInputs + 2 * radius + 1;
  work.columns.reserve(static_cast<std::size_t>(from.width() + 2 * kLanes + 2 * radius + 4) * kStrip);
  if (work.rows.size() < static_cast<std::size_t>(inputs)) work.rows.resize(static_cast<std::size_t>(inputs));
  for (int first = first_row; first < last_row; first += kStrip) {
    for (int i = 0; i < inputs; ++i) {
      const int furthest = (last_row - 1) * Filter::kInputs / 4 + radius;  // the last strip may have fewer rows
      const int row = HWY_MIN(first * Filter::kInputs / 4 - radius + i, furthest);
      work.rows[static_cast<std::size_t>(i)] = from.row(mirrored(row, from.height(), mirror));
    }
    alongColumns(filter, from.width(), work);
    mirrorColumns(from.width(), radius, mirror, work.columns.data());
    alongRows(filter, work, first, to);
  }
}

void blurRowsImpl(const FloatPlane& from, const GaussianKernel& kernel, int first_row, int last_row,
                  GaussianBlur::Workspace& work, FloatPlane& to) {
  const float* weights = kernel.weights.data();
  const auto with = [&](auto filter) {
    convolve(filter, from, Mirror::kWithoutLastPixel, first_row, last_row, work, to);
  };
  switch (kernel.radius()) {  // those of the default configuration are unrolled
    case 5:
      return with(Symmetric<5>{weights, 5});
    case 6:
      return with(Symmetric<6>{weights, 6});
    case 8:
      return with(Symmetric<8>{weights, 8});
    case 10:
      return with(Symmetric<10>{weights, 10});
    case 13:
      return with(Symmetric<13>{weights, 13});
    default:
      return with(Symmetric<0>{weights, kernel.radius()});
  }
}

void doubleRowsImpl(const FloatPlane& from, const DoublingKernel& kernel, int first_row, int last_row,
                    GaussianBlur::Workspace& work, FloatPlane& to) {
  convolve(Doubling{kernel.weights.data(), kernel.radius()}, from, Mirror::kWithLastPixel, first_row, last_row, work,
           to);
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace visual_localization
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace visual_localization {

HWY_EXPORT(blurRowsImpl);
HWY_EXPORT(doubleRowsImpl);

GaussianKernel::GaussianKernel(double sigma_px) {
  constexpr double kCutOff = 4.0;
  const int radius = static_cast<int>(std::lrint(2.0 * kCutOff * sigma_px + 1.0) | 1) / 2;
  std::vector<double> exact;
  double sum = 0.0;
  for (int k = 0; k <= radius; ++k) {
    exact.push_back(std::exp(-0.5 * k * k / (sigma_px * sigma_px)));
    sum += k == 0 ? exact.back() : 2.0 * exact.back();
  }
  for (const double weight : exact) weights.push_back(static_cast<float>(weight / sum));
}

DoublingKernel::DoublingKernel(double sigma_px) {
  const GaussianKernel blur(sigma_px);
  const int radius = blur.radius() / 2 + 1;
  std::vector<double> exact(2 * static_cast<std::size_t>(radius) + 1, 0.0);
  double* middle = exact.data() + radius;
  // The doubled image's even pixel 2 i lies a quarter of a pixel before pixel i, the odd one 2 i + 1 as far behind it.
  constexpr double kNear = 0.75;
  for (int k = -blur.radius(); k <= blur.radius(); ++k) {
    const int nearer = k >= 0 ? k / 2 : -((1 - k) / 2);
    const int other = nearer + (k % 2 == 0 ? -1 : 1);
    const double weight = blur.weights[static_cast<std::size_t>(std::abs(k))];
    middle[nearer] += kNear * weight;
    middle[other] += (1.0 - kNear) * weight;
  }
  for (const double weight : exact) weights.push_back(static_cast<float>(weight));
}

int mirrored(int i, int count, Mirror mirror) {
  const int last = mirror == Mirror::kWithLastPixel ? 1 : 0;
  if (count == 1) return 0;
  while (i < 0 || i >= count) i = i < 0 ? -i - last : 2 * (count - 1) - i + last;
  return i;
}

void GaussianBlur::blurRows(const FloatPlane& from, const GaussianKernel& kernel, int first_row, int last_row,
                            FloatPlane& to) {
  HWY_DYNAMIC_DISPATCH(blurRowsImpl)(from, kernel, first_row, last_row, work_, to);
}

void GaussianBlur::doubleRows(const FloatPlane& from, const DoublingKernel& kernel, int first_row, int last_row,
                              FloatPlane& to) {
  HWY_DYNAMIC_DISPATCH(doubleRowsImpl)(from, kernel, first_row, last_row, work_, to);
}

}  // namespace visual_localization
#endif
