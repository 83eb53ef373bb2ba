// Compiled once for each kind of CPU, see nearest_descriptors.cpp.
#define HWY_DISABLED_TARGETS (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128 | HWY_RVV)
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "src/features/gaussian_blur.cpp"
#include "visual_localization/features/gaussian_blur.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "src/features/transpose-inl.h"

HWY_BEFORE_NAMESPACE();
namespace visual_localization {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;
using Floats = hn::CappedTag<float, CacheLine::kFloats>;
using V = hn::Vec<Floats>;
constexpr int kLanes = static_cast<int>(hn::MaxLanes(Floats()));

#if HWY_TARGET == HWY_SCALAR  // one lane: nothing to turn

template <class At>
float convolve(const At& at, const GaussianKernel& kernel) {
  const int radius = kernel.radius();
  float sum = kernel.weights[0] * at(radius);
  for (int k = 1; k <= radius; ++k) {
    sum += kernel.weights[static_cast<std::size_t>(k)] * (at(radius - k) + at(radius + k));
  }
  return sum;
}

void blurColumns(const FloatPlane& from, const GaussianKernel& kernel, GaussianBlur::Workspace& work) {
  float* to = work.columns.data() + kernel.radius();
  for (int x = 0; x < from.width(); ++x) {
    to[x] = convolve([&](int i) { return work.rows[static_cast<std::size_t>(i)][x]; }, kernel);
  }
}

void blurAlongRows(const GaussianKernel& kernel, const GaussianBlur::Workspace& work, int row, int, FloatPlane& to) {
  for (int x = 0; x < to.width(); ++x) {
    to.row(row)[x] = convolve([&](int i) { return work.columns.data()[x + i]; }, kernel);
  }
}

#else

/// Four neighbouring results of a symmetric convolution. `at(i)` loads input i; result j has its centre at input
/// radius + j. Inputs at equal distance are added first, so there is one multiplication for the two, and the four
/// results share their inputs: two loads a weight.
template <class At>
HWY_INLINE void convolveFour(const At& at, const float* weights, int radius, V& s0, V& s1, V& s2, V& s3) {
  const Floats d;
  V a0 = at(0), a1 = at(1), a2 = at(2), a3 = at(3);
  V b0 = at(2 * radius), b1 = at(2 * radius + 1), b2 = at(2 * radius + 2), b3 = at(2 * radius + 3);
  s0 = s1 = s2 = s3 = hn::Zero(d);
  for (int k = radius; k > 0; --k) {
    const V weight = hn::Set(d, weights[k]);
    s0 = hn::MulAdd(weight, hn::Add(a0, b0), s0);
    s1 = hn::MulAdd(weight, hn::Add(a1, b1), s1);
    s2 = hn::MulAdd(weight, hn::Add(a2, b2), s2);
    s3 = hn::MulAdd(weight, hn::Add(a3, b3), s3);
    a0 = a1, a1 = a2, a2 = a3, a3 = at(radius - k + 4);
    b3 = b2, b2 = b1, b1 = b0, b0 = at(radius + k - 1);
  }
  const V weight = hn::Set(d, weights[0]);
  s0 = hn::MulAdd(weight, a0, s0);
  s1 = hn::MulAdd(weight, a1, s1);
  s2 = hn::MulAdd(weight, a2, s2);
  s3 = hn::MulAdd(weight, a3, s3);
}

/// A strip of kLanes rows, blurred along the columns, into work.columns from column `radius` on, where each column is
/// one vector.
void blurColumns(const FloatPlane& from, const GaussianKernel& kernel, GaussianBlur::Workspace& work) {
  const Floats d;
  const int radius = kernel.radius();
  float* to = work.columns.data() + radius * kLanes;
  for (int x = 0; x < from.width(); x += kLanes) {
    Transpose<Floats> block;
    for (int group = 0; group < kLanes / 4; ++group) {
      const float* const* rows = work.rows.data() + 4 * group;
      V s0, s1, s2, s3;
      convolveFour([&](int i) { return hn::Load(d, rows[i] + x); }, kernel.weights.data(), radius, s0, s1, s2, s3);
      block.put(group, s0, s1, s2, s3);
    }
    block.take([&](int i, V column) { hn::Store(column, d, to + (x + i) * kLanes); });
  }
}

/// The turned strip blurred along the rows, into rows [first_row, last_row) of `to`.
void blurAlongRows(const GaussianKernel& kernel, const GaussianBlur::Workspace& work, int first_row, int last_row,
                   FloatPlane& to) {
  const Floats d;
  float* rows[kLanes];
  for (int i = 0; i < kLanes; ++i) rows[i] = to.row(HWY_MIN(first_row + i, last_row - 1));
  for (int x = 0; x < to.width(); x += kLanes) {
    Transpose<Floats> block;
    for (int group = 0; group < kLanes / 4; ++group) {
      const float* columns = work.columns.data() + (x + 4 * group) * kLanes;
      V s0, s1, s2, s3;
      convolveFour([&](int i) { return hn::Load(d, columns + i * kLanes); }, kernel.weights.data(), kernel.radius(), s0,
                   s1, s2, s3);
      block.put(group, s0, s1, s2, s3);
    }
    const int used = last_row - first_row;
    block.take([&](int i, V row) {
      if (i < used) hn::Store(row, d, rows[i] + x);
    });
  }
}

#endif  // HWY_SCALAR

/// Continues the columns by their mirror image at both ends.
void mirrorColumns(int width, int radius, float* columns) {
  const Floats d;
  float* first = columns + radius * kLanes;
  for (int i = 1; i <= radius; ++i) {
    hn::Store(hn::Load(d, first + mirrored(-i, width) * kLanes), d, first - i * kLanes);
    const int right = width - 1 + i;
    hn::Store(hn::Load(d, first + mirrored(right, width) * kLanes), d, first + right * kLanes);
  }
}

void blurRowsImpl(const FloatPlane& from, const GaussianKernel& kernel, int first_row, int last_row,
                  GaussianBlur::Workspace& work, FloatPlane& to) {
  const int radius = kernel.radius();
  const std::size_t columns = static_cast<std::size_t>(from.width() + kLanes + 2 * radius + 4);
  work.columns.reserve(columns * kLanes);
  work.rows.resize(static_cast<std::size_t>(kLanes + 2 * radius));
  for (int first = first_row; first < last_row; first += kLanes) {
    for (int i = 0; i < kLanes + 2 * radius; ++i) {
      const int row = HWY_MIN(first + i, last_row - 1 + 2 * radius) - radius;  // a strip may have fewer rows
      work.rows[static_cast<std::size_t>(i)] = from.row(mirrored(row, from.height()));
    }
    blurColumns(from, kernel, work);
    mirrorColumns(from.width(), radius, work.columns.data());
    blurAlongRows(kernel, work, first, HWY_MIN(first + kLanes, last_row), to);
  }
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace visual_localization
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace visual_localization {

HWY_EXPORT(blurRowsImpl);

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

int mirrored(int i, int count) {
  if (count == 1) return 0;
  while (i < 0 || i >= count) i = i < 0 ? -i : 2 * (count - 1) - i;
  return i;
}

void GaussianBlur::blurRows(const FloatPlane& from, const GaussianKernel& kernel, int first_row, int last_row,
                            FloatPlane& to) {
  HWY_DYNAMIC_DISPATCH(blurRowsImpl)(from, kernel, first_row, last_row, work_, to);
}

}  // namespace visual_localization
#endif
