// Compiled once for each kind of CPU, see highway.h.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "features/sift/orientation.cpp"
#include <algorithm>
#include <cmath>
#include <cstddef>

#include "features/highway.h"
#include "features/sift/descriptor.h"
#include "features/sift/vectors-inl.h"

HWY_BEFORE_NAMESPACE();
namespace visual_localization {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;
using Floats = hn::CappedTag<float, 8>;  // a row is some 20 pixels long: wider vectors would be half empty
using Ints = hn::RebindToSigned<Floats>;
constexpr int kLanes = static_cast<int>(hn::MaxLanes(Floats()));
constexpr int kBins = SiftOrientations::kBins;

/// Bins and weights of the gradients at `count` pixels of a row; whole vectors are written.
void gradientsOfRow(const float* row, std::ptrdiff_t stride, const float* window, float row_weight, int count,
                    std::int32_t* bins, float* weights) {
  const Floats d;
  const Ints ints;
  for (int i = 0; i < count; i += kLanes) {
    hwy::Prefetch(row + i + kRowsAhead * stride);
    const auto gradient = polarGradientAt(d, row + i, stride);
    const auto weight = hn::Mul(hn::LoadU(d, window + i), hn::Set(d, row_weight));
    const auto bin = smallInteger(d, hn::Mul(gradient.turns, hn::Set(d, static_cast<float>(kBins))));
    const auto wrapped = hn::IfThenElse(hn::Eq(bin, hn::Set(ints, kBins)), hn::Zero(ints), bin);
    hn::StoreU(wrapped, ints, bins + i);
    hn::StoreU(hn::Mul(weight, gradient.magnitude), d, weights + i);
  }
}

/// The unsmoothed histogram of the square of `radius` around the point.
void collectImpl(const FloatPlane& level, int column, int row, int radius, SiftOrientations::Workspace& work) {
  constexpr int kCopies = 4;  // neighbours often share a bin: adding to it need not wait for the one before
  float copies[kCopies][kBins] = {};
  const int left = std::max(-radius, 1 - column);
  const int right = std::min(radius, level.width() - 2 - column);
  const int count = right - left + 1;
  const auto space = static_cast<std::size_t>(std::max(count, 0) + kLanes);
  if (work.bins.size() < space) work.bins.resize(space);
  work.weights.reserve(space);
  const std::int32_t* bins = work.bins.data();
  const float* weights = work.weights.data();
  for (int i = std::max(-radius, 1 - row); i <= std::min(radius, level.height() - 2 - row); ++i) {
    gradientsOfRow(level.row(row + i) + column + left, static_cast<std::ptrdiff_t>(level.stride()),
                   work.window.centre() + left, work.window.centre()[i], count, work.bins.data(), work.weights.data());
    for (int k = 0; k < count; ++k) copies[k % kCopies][bins[k]] += weights[k];
  }
  for (int bin = 0; bin < kBins; ++bin) {
    const auto b = static_cast<std::size_t>(bin);
    work.histogram[b] = (copies[0][bin] + copies[1][bin]) + (copies[2][bin] + copies[3][bin]);
  }
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace visual_localization
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace visual_localization {
namespace {

constexpr std::size_t kBins = SiftOrientations::kBins;
using Histogram = std::array<float, kBins>;

/// Convolution with (1 4 6 4 1) / 16 around the circle.
Histogram smoothed(const Histogram& from) {
  std::array<float, kBins + 4> around;  // with two bins of the other end at either end
  std::copy(from.end() - 2, from.end(), around.begin());
  std::copy(from.begin(), from.end(), around.begin() + 2);
  std::copy(from.begin(), from.begin() + 2, around.end() - 2);
  Histogram result;
  for (std::size_t i = 0; i < kBins; ++i) {
    result[i] = (around[i] + around[i + 4]) * (1.0F / 16.0F) + (around[i + 1] + around[i + 3]) * (4.0F / 16.0F) +
                around[i + 2] * (6.0F / 16.0F);
  }
  return result;
}

/// Vertex of the parabola through a peak and its neighbours, in degrees clockwise.
float peakAngle(std::size_t bin, float before, float peak, float after) {
  constexpr float kBinDegrees = 360.0F / static_cast<float>(kBins);
  float position = static_cast<float>(bin) + 0.5F * (before - after) / (before - 2.0F * peak + after);
  if (position < 0.0F) position += static_cast<float>(kBins);
  if (position >= static_cast<float>(kBins)) position -= static_cast<float>(kBins);
  const float angle_deg = 360.0F - kBinDegrees * position;
  return angle_deg >= 360.0F ? 0.0F : angle_deg;
}

}  // namespace

HWY_EXPORT(collectImpl);

void SiftOrientations::assign(const FloatPlane& level, const SiftPoint& point, std::vector<SiftPoint>& oriented) {
  constexpr float kWindow = 1.5F;  // standard deviation in multiples of the point's scale
  constexpr float kRadius = 4.5F;  // three standard deviations
  constexpr float kLeastPeak = 0.8F;
  const int radius = static_cast<int>(std::lrint(kRadius * point.sigma_px));
  work_.window.set(kWindow * point.sigma_px, radius);
  HWY_DYNAMIC_DISPATCH(collectImpl)(level, point.column, point.row, radius, work_);
  const Histogram histogram = smoothed(work_.histogram);
  const float least = kLeastPeak * *std::max_element(histogram.begin(), histogram.end());
  for (std::size_t i = 0; i < kBins; ++i) {
    const float before = histogram[(i + kBins - 1) % kBins];
    const float after = histogram[(i + 1) % kBins];
    if (histogram[i] <= before || histogram[i] <= after || histogram[i] < least) continue;
    oriented.push_back(point);
    oriented.back().angle_deg = peakAngle(i, before, histogram[i], after);
  }
}

}  // namespace visual_localization
#endif
