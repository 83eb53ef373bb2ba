// Compiled once for each kind of CPU, see nearest_descriptors.cpp.
#define HWY_DISABLED_TARGETS (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128 | HWY_RVV)
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "src/features/sift_descriptor.cpp"
#include "visual_localization/features/sift_descriptor.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "src/features/gradient-inl.h"

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
constexpr int kHistograms = kPadded * kPadded * kDirections;
constexpr int kCopies = 4;  ///< neighbours add to the same bins: they need not wait for each other
constexpr int kElements = kCells * kCells * kDirections;

/// A point's square of cells, turned, in the level's pixels.
struct Square {
  float cosine;
  float sine;
  float cell_px;   ///< side of a cell
  float reach_px;  ///< from the centre to where the weight of the outermost cell vanishes
  float angle_turns;
  int column;
  int row;
};

struct Span {
  int first;
  int last;
};

/// Adds the condition |slope * j + offset| < reach to a span of j.
void restrict(float slope, float offset, float reach, float& low, float& high) {
  constexpr float kLevel = 1e-6F;
  if (std::abs(slope) < kLevel) {
    if (std::abs(offset) >= reach) high = low - 1.0F;
    return;
  }
  const float a = (-reach - offset) / slope;
  const float b = (reach - offset) / slope;
  low = std::max(low, std::min(a, b));
  high = std::min(high, std::max(a, b));
}

/// Columns, from the centre, of the pixels inside the square in row `i` from the centre.
Span columnsOf(const Square& square, int i, int left, int right) {
  const float row = static_cast<float>(i);
  float low = static_cast<float>(left);
  float high = static_cast<float>(right);
  restrict(square.cosine, -row * square.sine, square.reach_px, low, high);
  restrict(square.sine, row * square.cosine, square.reach_px, low, high);
  return {static_cast<int>(std::ceil(low)), static_cast<int>(std::floor(high))};
}

/// Position in cells, [0, 5) from the outer edge of the padding's middle, split into cell and share of the next one.
struct CellPosition {
  hn::Vec<Ints> cell;
  V share;

  HWY_INLINE explicit CellPosition(V from_centre) {
    const Floats d;
    constexpr float kFirstCentre = 0.5F * kPadded - 0.5F;
    const V position = hn::Add(from_centre, hn::Set(d, kFirstCentre));
    const V inside = hn::Min(hn::Max(position, hn::Zero(d)), hn::Set(d, kPadded - 1 - 1e-4F));
    cell = hn::ConvertTo(Ints(), inside);
    share = hn::Sub(inside, hn::ConvertTo(d, cell));
  }
};

/// What the pixels in `span` of row `i` add, into work from sample `n` on; whole vectors are written.
void sampleRow(const FloatPlane& level, const Square& square, int i, Span span, int n, SiftDescriber::Workspace& work) {
  const Floats d;
  const Ints ints;
  const float row = static_cast<float>(i);
  const float per_px = 1.0F / square.cell_px;
  const V cosine = hn::Set(d, square.cosine * per_px);
  const V sine = hn::Set(d, square.sine * per_px);
  const V row_cosine = hn::Set(d, row * square.cosine * per_px);
  const V row_sine = hn::Set(d, row * square.sine * per_px);
  const V row_weight = hn::Set(d, work.window.centre()[i]);
  const float* pixels = level.row(square.row + i) + square.column;
  std::int32_t* cells = reinterpret_cast<std::int32_t*>(work.cells.data());
  for (int j = span.first; j <= span.last; j += kLanes, n += kLanes) {
    const auto gradient = gradientAt(d, pixels + j, static_cast<std::ptrdiff_t>(level.stride()));
    const V weight = hn::Mul(magnitudeOf(gradient), hn::Mul(row_weight, hn::LoadU(d, work.window.centre() + j)));
    const V turns = hn::Sub(turnsOf(d, gradient), hn::Set(d, square.angle_turns));
    const V direction = hn::Mul(hn::Sub(turns, hn::Floor(turns)), hn::Set(d, kDirections));
    const V column = hn::ConvertTo(d, hn::Iota(ints, j));
    const CellPosition across(hn::Sub(hn::Mul(column, cosine), row_sine));
    const CellPosition down(hn::MulAdd(column, sine, row_cosine));
    const auto cell = hn::Add(hn::Mul(down.cell, hn::Set(ints, kPadded)), across.cell);
    hn::StoreU(hn::ShiftLeft<3>(cell), ints, cells + n);
    hn::StoreU(direction, d, work.directions.data() + n);
    const V lower = hn::Mul(weight, down.share);
    const V upper = hn::Sub(weight, lower);
    const V lower_right = hn::Mul(lower, across.share);
    const V upper_right = hn::Mul(upper, across.share);
    hn::StoreU(hn::Sub(upper, upper_right), d, work.weights[0].data() + n);
    hn::StoreU(upper_right, d, work.weights[1].data() + n);
    hn::StoreU(hn::Sub(lower, lower_right), d, work.weights[2].data() + n);
    hn::StoreU(lower_right, d, work.weights[3].data() + n);
  }
}

/// Adds `count` samples to the histograms. The two directions nearest to a sample's are found for all eight at once:
/// the weight of each falls linearly with the distance around the circle.
void addSamples(int count, SiftDescriber::Workspace& work) {
  static_assert(kDirections == 8, "a cell is shifted by 3 bits");
  const hn::CappedTag<float, kDirections> d;
  constexpr int kStep = static_cast<int>(hn::MaxLanes(d));
  const std::int32_t* cells = reinterpret_cast<const std::int32_t*>(work.cells.data());
  const auto half_circle = hn::Set(d, 0.5F * kDirections);
  const auto nearly_half = hn::Set(d, 0.5F * kDirections - 1.0F);
  for (int part = 0; part < kDirections; part += kStep) {
    const auto bins = hn::Iota(d, static_cast<float>(part));
    for (int k = 0; k < count; ++k) {
      float* upper = work.histograms.data() + k % kCopies * kHistograms + cells[k] + part;
      float* lower = upper + kPadded * kDirections;
      const auto distance = hn::Abs(hn::Sub(hn::Set(d, work.directions.data()[k]), bins));
      const auto across = hn::Abs(hn::Sub(distance, half_circle));
      const auto share = hn::Max(hn::Sub(across, nearly_half), hn::Zero(d));
      const auto add = [&](int cell, float* at) {
        hn::Store(hn::MulAdd(share, hn::Set(d, work.weights[cell].data()[k]), hn::Load(d, at)), d, at);
      };
      add(0, upper);
      add(1, upper + kDirections);
      add(2, lower);
      add(3, lower + kDirections);
    }
  }
}

/// The inner cells of all copies, one after the other.
void gather(const float* histograms, float* elements) {
  const hn::CappedTag<float, kDirections> d;
  constexpr int kStep = static_cast<int>(hn::MaxLanes(d));
  for (int r = 0; r < kCells; ++r) {
    const float* row = histograms + ((r + 1) * kPadded + 1) * kDirections;
    for (int i = 0; i < kCells * kDirections; i += kStep) {
      auto sum = hn::Load(d, row + i);
      for (int copy = 1; copy < kCopies; ++copy) sum = hn::Add(sum, hn::Load(d, row + copy * kHistograms + i));
      hn::Store(sum, d, elements + r * kCells * kDirections + i);
    }
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

/// Lowe 2004, section 6.1: clips large elements, scales to a length of 512 and rounds.
void toBytes(float* elements, std::uint8_t* descriptor) {
  constexpr float kLargest = 0.2F;
  constexpr float kLength = 512.0F;
  constexpr float kLeastLength = 1.1920929e-7F;
  const Floats d;
  const hn::Rebind<std::uint8_t, Floats> bytes;
  const V largest = hn::Set(d, kLargest * lengthOf(elements));
  for (int i = 0; i < kElements; i += kLanes) {
    hn::Store(hn::Min(hn::Load(d, elements + i), largest), d, elements + i);
  }
  const V scale = hn::Set(d, kLength / std::max(lengthOf(elements), kLeastLength));
  for (int i = 0; i < kElements; i += kLanes) {
    const auto whole = hn::NearestInt(hn::Mul(hn::Load(d, elements + i), scale));
    hn::StoreU(hn::DemoteTo(bytes, whole), bytes, descriptor + i);
  }
}

void describeImpl(const FloatPlane& level, const SiftPoint& point, SiftDescriber::Workspace& work,
                  std::uint8_t* descriptor) {
  constexpr float kCellSigmas = 3.0F;
  constexpr float kDegree = 3.14159265F / 180.0F;
  const float turn_deg = point.angle_deg > 0.0F ? 360.0F - point.angle_deg : 0.0F;
  const float cell_px = kCellSigmas * point.sigma_px;
  const float reach_px = 0.5F * (kCells + 1) * cell_px;
  const Square square{std::cos(turn_deg * kDegree),
                      std::sin(turn_deg * kDegree),
                      cell_px,
                      reach_px,
                      turn_deg / 360.0F,
                      static_cast<int>(std::lrint(point.x_px)),
                      static_cast<int>(std::lrint(point.y_px))};
  constexpr float kDiagonal = 1.41421356F;
  const int radius = static_cast<int>(std::ceil(reach_px * kDiagonal));
  work.window.set(0.5F * kCells * cell_px, radius);

  const auto space = static_cast<std::size_t>(SiftDescriber::Workspace::kSamples + 2 * radius + 1 + kLanes);
  for (AlignedFloats* buffer :
       {&work.cells, &work.directions, &work.weights[0], &work.weights[1], &work.weights[2], &work.weights[3]}) {
    buffer->reserve(space);
  }
  work.histograms.reserve(kCopies * kHistograms);
  std::fill_n(work.histograms.data(), kCopies * kHistograms, 0.0F);

  const int left = std::max(-radius, 1 - square.column);
  const int right = std::min(radius, level.width() - 2 - square.column);
  const int bottom = std::min(radius, level.height() - 2 - square.row);
  int samples = 0;
  for (int i = std::max(-radius, 1 - square.row); i <= bottom; ++i) {
    const Span span = columnsOf(square, i, left, right);
    if (span.first > span.last) continue;
    sampleRow(level, square, i, span, samples, work);
    samples += span.last - span.first + 1;
    if (samples < SiftDescriber::Workspace::kSamples) continue;
    addSamples(samples, work);
    samples = 0;
  }
  addSamples(samples, work);
  alignas(64) float elements[kElements];
  gather(work.histograms.data(), elements);
  toBytes(elements, descriptor);
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace visual_localization
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace visual_localization {

HWY_EXPORT(describeImpl);

void SiftDescriber::describe(const FloatPlane& level, const SiftPoint& point, std::uint8_t* descriptor) {
  HWY_DYNAMIC_DISPATCH(describeImpl)(level, point, work_, descriptor);
}

}  // namespace visual_localization
#endif
