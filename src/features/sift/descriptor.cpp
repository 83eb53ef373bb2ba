// Compiled once for each kind of CPU, see highway.h.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "features/sift/descriptor.cpp"
#include "features/sift/descriptor.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "features/highway.h"
#include "features/sift/vectors-inl.h"

HWY_BEFORE_NAMESPACE();
namespace visual_localization {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;
using Floats = hn::CappedTag<float, CacheLine::kFloats>;
using Ints = hn::RebindToSigned<Floats>;
using V = hn::Vec<Floats>;
constexpr int kLanes = static_cast<int>(hn::MaxLanes(Floats()));

constexpr int kCells = 4;            ///< along each side
constexpr int kPadded = kCells + 2;  ///< with cells around, into which what lies outside is added unseen
constexpr int kDirections = 8;
constexpr std::ptrdiff_t kRow = std::ptrdiff_t{kPadded} * kDirections;  ///< floats of a row of cells
constexpr std::ptrdiff_t kHistograms = kPadded * kRow;                  ///< floats of all cells
constexpr int kCopies = 4;  ///< a group of neighbours adds to the same bins: none need wait for the one before
constexpr int kElements = kCells * kCells * kDirections;

/// A point's square of cells, turned, in the level's pixels.
struct Square {
  float cosine;
  float sine;
  float cosine_per_px;  ///< in cells
  float sine_per_px;    ///< in cells
  float cell_px;        ///< side of a cell
  float reach_px;       ///< from the centre to where the weight of the outermost cell vanishes
  float turns;          ///< the point's angle, counter-clockwise
  int column;
  int row;
};

/// Two opposite sides of the square: which columns of a row lie between them.
class Sides {
 public:
  /// |slope * column + offset of the row| < reach
  Sides(float slope, float reach) {
    constexpr float kLevel = 1e-6F;  // as good as parallel to the rows: all columns or none
    inverse_ = 1.0F / (std::abs(slope) > kLevel ? slope : kLevel);
    half_ = reach * std::abs(inverse_);
  }
  float first(float offset) const { return -offset * inverse_ - half_; }
  float last(float offset) const { return -offset * inverse_ + half_; }

 private:
  float inverse_;
  float half_;
};

/// Position along one side of the square in cells, (0, 5): 0 is the middle of the cells before the first.
struct CellPosition {
  V cell;
  V share;  ///< of the next cell

  HWY_INLINE explicit CellPosition(V from_centre) {
    const Floats d;
    const V position = hn::Add(from_centre, hn::Set(d, 0.5F * (kPadded - 1)));
    cell = hn::Floor(position);
    share = hn::Sub(position, cell);
  }
};

/// What the pixels in columns [first, first + count) of row `i` from the centre add, into the samples from `n` on.
HWY_INLINE void sampleRow(const FloatPlane& level, const Square& square, int i, int first, int count,
                          const GaussianWindow& window, int n, SiftDescriber::Samples& samples) {
  const Floats d;
  const float row = static_cast<float>(i);
  const V row_weight = hn::Set(d, window.centre()[i]);
  const float* pixels = level.row(square.row + i) + square.column;
  const auto stride = static_cast<std::ptrdiff_t>(level.stride());
  V column = hn::Add(hn::Iota(d, 0.0F), hn::Set(d, static_cast<float>(first)));
  for (const int end = n + count; n < end; n += kLanes, first += kLanes) {
    hwy::Prefetch(pixels + first + kRowsAhead * stride);
    const auto gradient = polarGradientAt(d, pixels + first, stride);
    const V weight = hn::Mul(gradient.magnitude, hn::Mul(row_weight, hn::LoadU(d, window.centre() + first)));
    const V turns = hn::Sub(gradient.turns, hn::Set(d, square.turns));
    const V direction = hn::Mul(hn::Sub(turns, hn::Floor(turns)), hn::Set(d, kDirections));
    const CellPosition across(
        hn::MulAdd(column, hn::Set(d, square.cosine_per_px), hn::Set(d, -row * square.sine_per_px)));
    const CellPosition down(hn::MulAdd(column, hn::Set(d, square.sine_per_px), hn::Set(d, row * square.cosine_per_px)));
    const V cell = hn::MulAdd(down.cell, hn::Set(d, kPadded), across.cell);
    const V lower = hn::Mul(weight, down.share);
    const V upper = hn::Sub(weight, lower);
    const V lower_right = hn::Mul(lower, across.share);
    const V upper_right = hn::Mul(upper, across.share);
    hn::StoreU(smallInteger(d, hn::Mul(cell, hn::Set(d, kDirections))), Ints(), samples.bins + n);
    hn::StoreU(direction, d, samples.directions + n);
    hn::StoreU(hn::Sub(upper, upper_right), d, samples.upper_left + n);
    hn::StoreU(upper_right, d, samples.upper_right + n);
    hn::StoreU(hn::Sub(lower, lower_right), d, samples.lower_left + n);
    hn::StoreU(lower_right, d, samples.lower_right + n);
    column = hn::Add(column, hn::Set(d, kLanes));
  }
}

/// Fills the samples up to whole groups of kCopies by such as add nothing.
int padded(int count, SiftDescriber::Samples& samples) {
  for (; count % kCopies != 0; ++count) {
    samples.bins[count] = 0;
    samples.directions[count] = samples.upper_left[count] = samples.upper_right[count] = 0.0F;
    samples.lower_left[count] = samples.lower_right[count] = 0.0F;
  }
  return count;
}

/// Adds `count` samples to the histograms. The two directions nearest to a sample's are found for all eight at once:
/// the weight of each falls linearly with the distance around the circle.
void addSamples(int count, SiftDescriber::Samples& samples, float* histograms) {
  const hn::CappedTag<float, kDirections> d;
  constexpr int kStep = static_cast<int>(hn::MaxLanes(d));
  const auto half_circle = hn::Set(d, 0.5F * kDirections);
  const auto nearly_half = hn::Set(d, 0.5F * kDirections - 1.0F);
  const int end = padded(count, samples);
  for (int part = 0; part < kDirections; part += kStep) {
    const auto bins = hn::Iota(d, static_cast<float>(part));
    const auto add = [&](int k, float* copy) {
      float* upper = copy + samples.bins[k];
      float* lower = upper + kRow;
      const auto distance = hn::Abs(hn::Sub(hn::Set(d, samples.directions[k]), bins));
      const auto across = hn::Abs(hn::Sub(distance, half_circle));
      const auto share = hn::Max(hn::Sub(across, nearly_half), hn::Zero(d));
      const auto to = [&](float weight, float* at) {
        hn::Store(hn::MulAdd(share, hn::Set(d, weight), hn::Load(d, at)), d, at);
      };
      to(samples.upper_left[k], upper);
      to(samples.upper_right[k], upper + kDirections);
      to(samples.lower_left[k], lower);
      to(samples.lower_right[k], lower + kDirections);
    };
    float* copies = histograms + part;
    for (int k = 0; k < end; k += kCopies) {
      add(k, copies);
      add(k + 1, copies + kHistograms);
      add(k + 2, copies + 2 * kHistograms);
      add(k + 3, copies + 3 * kHistograms);
    }
  }
}

/// The inner cells of all copies, one after the other.
void gather(const float* histograms, float* elements) {
  const hn::CappedTag<float, kDirections> d;
  constexpr int kStep = static_cast<int>(hn::MaxLanes(d));
  for (int r = 0; r < kCells; ++r) {
    const float* row = histograms + (r + 1) * kRow + kDirections;
    for (int i = 0; i < kCells * kDirections; i += kStep) {
      auto sum = hn::Load(d, row + i);
      for (int copy = 1; copy < kCopies; ++copy) sum = hn::Add(sum, hn::Load(d, row + copy * kHistograms + i));
      hn::Store(sum, d, elements + i);
    }
    elements += std::ptrdiff_t{kCells} * kDirections;
  }
}

float lengthOf(const float* elements) {
  const Floats d;
  V sum = hn::Zero(d);
  for (int i = 0; i < kElements; i += kLanes) {
    const V v = hn::Load(d, elements + i);
    sum = hn::MulAdd(v, v, sum);
  }
  return std::sqrt(hn::GetLane(hn::SumOfLanes(d, sum)));
}

/// Replaces each element by its square root, so that the length becomes that of the sum.
void takeRoots(float* elements) {
  const Floats d;
  for (int i = 0; i < kElements; i += kLanes) hn::Store(hn::Sqrt(hn::Load(d, elements + i)), d, elements + i);
}

/// Lowe 2004, section 6.1: clips large elements, scales to a length of 512 and rounds.
void toBytes(float* elements, bool hellinger, std::uint8_t* descriptor) {
  constexpr float kLargest = 0.2F;
  constexpr float kLength = 512.0F;
  constexpr float kLeastLength = 1.1920929e-7F;
  const Floats d;
  const hn::Rebind<std::uint8_t, Floats> bytes;
  const V largest = hn::Set(d, kLargest * lengthOf(elements));
  for (int i = 0; i < kElements; i += kLanes) {
    hn::Store(hn::Min(hn::Load(d, elements + i), largest), d, elements + i);
  }
  if (hellinger) takeRoots(elements);
  const V scale = hn::Set(d, kLength / std::max(lengthOf(elements), kLeastLength));
  for (int i = 0; i < kElements; i += kLanes) {
    const auto whole = hn::NearestInt(hn::Mul(hn::Load(d, elements + i), scale));
    hn::StoreU(hn::DemoteTo(bytes, whole), bytes, descriptor + i);
  }
}

Square squareOf(const SiftPoint& point) {
  constexpr float kCellSigmas = 3.0F;
  constexpr float kDegree = 3.14159265F / 180.0F;
  constexpr float kInside = 0.9999F;  // what rounding may add must not lead out of the cells
  const float turn_deg = point.angle_deg > 0.0F ? 360.0F - point.angle_deg : 0.0F;
  const float cell_px = kCellSigmas * point.sigma_px;
  return {std::cos(turn_deg * kDegree),
          std::sin(turn_deg * kDegree),
          std::cos(turn_deg * kDegree) / cell_px,
          std::sin(turn_deg * kDegree) / cell_px,
          cell_px,
          0.5F * (kCells + 1) * cell_px * kInside,
          turn_deg / 360.0F,
          static_cast<int>(std::lrint(point.x_px)),
          static_cast<int>(std::lrint(point.y_px))};
}

/// Collects the gradients of all pixels inside the square that have neighbours.
void collect(const FloatPlane& level, const Square& square, int radius, SiftDescriber::Workspace& work,
             float* histograms) {
  constexpr int kCapacity = SiftDescriber::Samples::kCapacity;
  const auto left = static_cast<float>(std::max(-radius, 1 - square.column));
  const auto right = static_cast<float>(std::min(radius, level.width() - 2 - square.column));
  const int bottom = std::min(radius, level.height() - 2 - square.row);
  const Sides sides(square.cosine, square.reach_px);
  const Sides ends(square.sine, square.reach_px);
  int samples = 0;
  for (int i = std::max(-radius, 1 - square.row); i <= bottom; ++i) {
    const float across = -static_cast<float>(i) * square.sine;
    const float down = static_cast<float>(i) * square.cosine;
    int first = static_cast<int>(std::ceil(std::max({left, sides.first(across), ends.first(down)})));
    const int end = static_cast<int>(std::floor(std::min({right, sides.last(across), ends.last(down)}))) + 1;
    while (first < end) {
      const int count = std::min(end - first, kCapacity - samples);
      sampleRow(level, square, i, first, count, work.window, samples, work.samples);
      first += count;
      samples += count;
      if (samples < kCapacity) continue;
      addSamples(samples, work.samples, histograms);
      samples = 0;
    }
  }
  addSamples(samples, work.samples, histograms);
}

void describeImpl(const FloatPlane& level, const SiftPoint& point, bool hellinger, SiftDescriber::Workspace& work,
                  std::uint8_t* descriptor) {
  constexpr float kDiagonal = 1.41421356F;
  const Square square = squareOf(point);
  const int radius = static_cast<int>(std::ceil(square.reach_px * kDiagonal));
  work.window.set(0.5F * kCells * square.cell_px, radius);
  alignas(64) float histograms[kCopies * kHistograms] = {};
  collect(level, square, radius, work, histograms);
  alignas(64) float elements[kElements];
  gather(histograms, elements);
  toBytes(elements, hellinger, descriptor);
}

// Orientations: Lowe 2004, section 5.

using RowFloats = hn::CappedTag<float, 8>;  // a row is some 20 pixels long: wider vectors would be half empty
using RowInts = hn::RebindToSigned<RowFloats>;
constexpr int kRowLanes = static_cast<int>(hn::MaxLanes(RowFloats()));

/// Bins and weights of the gradients at `count` pixels of a row; whole vectors are written.
void gradientsOfRow(const float* row, std::ptrdiff_t stride, const float* window, float row_weight, int count,
                    std::int32_t* bins, float* weights) {
  const RowFloats d;
  const RowInts ints;
  for (int i = 0; i < count; i += kRowLanes) {
    hwy::Prefetch(row + i + kRowsAhead * stride);
    const auto gradient = polarGradientAt(d, row + i, stride);
    const auto weight = hn::Mul(hn::LoadU(d, window + i), hn::Set(d, row_weight));
    const auto bin = smallInteger(d, hn::Mul(gradient.turns, hn::Set(d, static_cast<float>(SiftOrientations::kBins))));
    const auto wrapped = hn::IfThenElse(hn::Eq(bin, hn::Set(ints, SiftOrientations::kBins)), hn::Zero(ints), bin);
    hn::StoreU(wrapped, ints, bins + i);
    hn::StoreU(hn::Mul(weight, gradient.magnitude), d, weights + i);
  }
}

/// The unsmoothed histogram of the square of `radius` around the point.
void collectImpl(const FloatPlane& level, int column, int row, int radius, SiftOrientations::Workspace& work) {
  float copies[kCopies][SiftOrientations::kBins] = {};
  const int left = std::max(-radius, 1 - column);
  const int right = std::min(radius, level.width() - 2 - column);
  const int count = right - left + 1;
  const auto space = static_cast<std::size_t>(std::max(count, 0) + kRowLanes);
  if (work.bins.size() < space) work.bins.resize(space);
  work.weights.reserve(space);
  const std::int32_t* bins = work.bins.data();
  const float* weights = work.weights.data();
  for (int i = std::max(-radius, 1 - row); i <= std::min(radius, level.height() - 2 - row); ++i) {
    gradientsOfRow(level.row(row + i) + column + left, static_cast<std::ptrdiff_t>(level.stride()),
                   work.window.centre() + left, work.window.centre()[i], count, work.bins.data(), work.weights.data());
    for (int k = 0; k < count; ++k) copies[k % kCopies][bins[k]] += weights[k];
  }
  for (int bin = 0; bin < SiftOrientations::kBins; ++bin) {
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
HWY_EXPORT(describeImpl);

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

void SiftDescriber::describe(const FloatPlane& level, const SiftPoint& point, std::uint8_t* descriptor) {
  HWY_DYNAMIC_DISPATCH(describeImpl)(level, point, hellinger_, work_, descriptor);
}

}  // namespace visual_localization
#endif
