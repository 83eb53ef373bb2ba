// Compiled once for each kind of CPU, see highway.h.
#define VISUAL_LOCALIZATION_WANT_VNNI
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "features/nearest_descriptors.cpp"
#include "features/nearest_descriptors.h"

#include <cmath>
#include <cstring>
#include <limits>
#include <numeric>
#include <vector>

#include "features/highway.h"

HWY_BEFORE_NAMESPACE();
#if HWY_TARGET == HWY_AVX3_DL
HWY_PUSH_ATTRIBUTES("avx512vnni")  // which Highway asks of such a CPU, but does not tell the compiler
#endif
namespace visual_localization {
namespace HWY_NAMESPACE {
namespace {

#if HWY_TARGET == HWY_SCALAR
void findNearestImpl(const LocalFeatures& a, const LocalFeatures& b, NearestDescriptors& nearest) {
  findNearestPlain(a, b, nearest);
}
void findNearestWithinImpl(const LocalFeatures& a, const LocalFeatures& b, float max_dy_px,
                           NearestDescriptors& nearest) {
  findNearestWithinPlain(a, b, max_dy_px, nearest);
}
#else

namespace hn = hwy::HWY_NAMESPACE;

using Ints = hn::ScalableTag<std::int32_t>;
using Floats = hn::ScalableTag<float>;
using Shorts = hn::Repartition<std::int16_t, Ints>;

constexpr std::size_t kBins = kPackedBytes;

/// Descriptors of one image side by side, so that one vector instruction takes a step in as many scalar products as
/// it has lanes: for each tile of that many descriptors, for each group of bins, the groups of all of them.
///
/// CPUs with VNNI multiply four unsigned by four signed bytes in a step, so there a group is four bins minus 128, and
/// the difference, 128 times the sum of the other descriptor, is added back. All others multiply two 16-bit numbers.
#if HWY_TARGET == HWY_AVX3_DL
constexpr std::size_t kGroup = 4;
using Packed = std::uint8_t;
HWY_INLINE void packGroup(const std::uint8_t* bins, Packed* to) {
  std::uint32_t group = 0;
  std::memcpy(&group, bins, sizeof(group));
  group ^= 0x80808080U;
  std::memcpy(to, &group, sizeof(group));
}
#else
constexpr std::size_t kGroup = 2;
using Packed = std::int16_t;
HWY_INLINE void packGroup(const std::uint8_t* bins, Packed* to) {
  const std::uint32_t group = bins[0] | static_cast<std::uint32_t>(bins[1]) << 16;
  std::memcpy(to, &group, sizeof(group));
}
#endif
constexpr std::size_t kGroups = kBins / kGroup;

/// In `order`. `padded`: the number of features, filled up to whole tiles with zeros.
void pack(const LocalFeatures& features, const std::vector<std::uint32_t>& order, std::size_t lanes, std::size_t padded,
          Packed* to) {
  static constexpr std::uint8_t kNone[kBins] = {};
  for (std::size_t i = 0; i < padded; ++i) {
    const std::uint8_t* from = i < features.size() ? features.bytes(order[i]) : kNone;
    Packed* tile = to + i / lanes * lanes * kBins + i % lanes * kGroup;
    for (std::size_t group = 0; group < kGroups; ++group) {
      packGroup(from + group * kGroup, tile + group * lanes * kGroup);
    }
  }
}

/// One descriptor of the other image, every group of which meets all lanes of a tile at once.
struct Row {
  alignas(4) Packed groups[kBins];
  std::int32_t correction = 0;  ///< what the packing took away from each scalar product

  HWY_INLINE void set(const std::uint8_t* descriptor) {
#if HWY_TARGET == HWY_AVX3_DL
    std::memcpy(groups, descriptor, kBins);
    const __m512i ones = _mm512_set1_epi8(1);
    __m512i sum = _mm512_setzero_si512();
    for (std::size_t i = 0; i < kBins; i += sizeof(sum)) {
      sum = _mm512_dpbusd_epi32(sum, _mm512_loadu_si512(descriptor + i), ones);
    }
    correction = 128 * _mm512_reduce_add_epi32(sum);
#else
    for (std::size_t i = 0; i < kBins; ++i) groups[i] = descriptor[i];
#endif
  }
};

HWY_INLINE hn::Vec<Ints> broadcast(const Row& row, std::size_t group) {
  std::int32_t bits = 0;
  std::memcpy(&bits, row.groups + group * kGroup, sizeof(bits));
  return hn::Set(Ints(), bits);
}

/// `sum` + the scalar products of one group with a tile's.
HWY_INLINE hn::Vec<Ints> multiplyAdd(hn::Vec<Ints> row, const Packed* tile, hn::Vec<Ints>& sum, hn::Vec<Ints>& odd) {
#if HWY_TARGET == HWY_AVX3_DL
  (void)odd;
  return hn::Vec<Ints>{_mm512_dpbusd_epi32(sum.raw, row.raw, _mm512_load_si512(tile))};
#else
  return hn::ReorderWidenMulAccumulate(Ints(), hn::BitCast(Shorts(), row), hn::Load(Shorts(), tile), sum, odd);
#endif
}

/// The sum of all groups, of which some CPUs add the odd ones apart.
HWY_INLINE hn::Vec<Ints> total(hn::Vec<Ints> sum, hn::Vec<Ints> odd) {
#if HWY_TARGET == HWY_AVX3_DL
  (void)odd;
  return sum;
#else
  return hn::RearrangeToOddPlusEven(sum, odd);
#endif
}

constexpr std::size_t kRows = 4;  ///< of B at a time: each load of a tile serves so many scalar products

HWY_INLINE hn::Vec<Floats> toFloats(hn::Vec<Ints> sum) { return hn::ConvertTo(Floats(), sum); }

/// Scalar products of kRows rows with `kTiles` tiles, one lane each: those of the first tile, then of the second. Two
/// tiles at a time keep eight sums going, enough to hide how long one step takes.
template <std::size_t kTiles>
HWY_INLINE void multiply(const Row* rows, const Packed* tiles, std::size_t /*dimension*/, hn::Vec<Floats>* products) {
  const Ints ints;
  const std::size_t step = hn::Lanes(ints) * kGroup;
  const Packed* second = tiles + (kTiles - 1) * kGroups * step;
  hn::Vec<Ints> s0 = hn::Set(ints, rows[0].correction), s1 = hn::Set(ints, rows[1].correction),
                s2 = hn::Set(ints, rows[2].correction), s3 = hn::Set(ints, rows[3].correction);
  hn::Vec<Ints> t0 = s0, t1 = s1, t2 = s2, t3 = s3;
  hn::Vec<Ints> o0 = hn::Zero(ints), o1 = o0, o2 = o0, o3 = o0, p0 = o0, p1 = o0, p2 = o0, p3 = o0;
  for (std::size_t group = 0; group < kGroups; ++group, tiles += step, second += step) {
    const auto r0 = broadcast(rows[0], group), r1 = broadcast(rows[1], group), r2 = broadcast(rows[2], group),
               r3 = broadcast(rows[3], group);
    s0 = multiplyAdd(r0, tiles, s0, o0);
    s1 = multiplyAdd(r1, tiles, s1, o1);
    s2 = multiplyAdd(r2, tiles, s2, o2);
    s3 = multiplyAdd(r3, tiles, s3, o3);
    if (kTiles == 1) continue;
    t0 = multiplyAdd(r0, second, t0, p0);
    t1 = multiplyAdd(r1, second, t1, p1);
    t2 = multiplyAdd(r2, second, t2, p2);
    t3 = multiplyAdd(r3, second, t3, p3);
  }
  products[0] = toFloats(total(s0, o0)), products[1] = toFloats(total(s1, o1));
  products[2] = toFloats(total(s2, o2)), products[3] = toFloats(total(s3, o3));
  if (kTiles == 1) return;
  products[4] = toFloats(total(t0, p0)), products[5] = toFloats(total(t1, p1));
  products[6] = toFloats(total(t2, p2)), products[7] = toFloats(total(t3, p3));
}

template <bool kWhole>
void orderBy(const LocalFeatures& features, std::vector<std::uint32_t>& order) {
  if (!kWhole) return orderByRow(features, order);
  order.resize(features.size());
  std::iota(order.begin(), order.end(), 0U);
}

/// Descriptors of floats side by side: for each tile of as many as there are lanes, for each element, that of all of
/// them.
void pack(const LocalFeatures& features, const std::vector<std::uint32_t>& order, std::size_t lanes, std::size_t padded,
          float* to) {
  const std::size_t dimension = features.form().dimension;
  for (std::size_t i = 0; i < padded; ++i) {
    float* tile = to + i / lanes * lanes * dimension + i % lanes;
    for (std::size_t k = 0; k < dimension; ++k) {
      tile[k * lanes] = i < features.size() ? features.floats(order[i])[k] : 0.0F;
    }
  }
}

struct FloatRow {
  const float* elements = nullptr;
  HWY_INLINE void set(const float* descriptor) { elements = descriptor; }
};

template <std::size_t kTiles>
HWY_INLINE void multiply(const FloatRow* rows, const float* tiles, std::size_t dimension, hn::Vec<Floats>* products) {
  const Floats floats;
  const std::size_t step = hn::Lanes(floats);
  const float* second = tiles + (kTiles - 1) * dimension * step;
  hn::Vec<Floats> s0 = hn::Zero(floats), s1 = s0, s2 = s0, s3 = s0, t0 = s0, t1 = s0, t2 = s0, t3 = s0;
  for (std::size_t k = 0; k < dimension; ++k, tiles += step, second += step) {
    const auto r0 = hn::Set(floats, rows[0].elements[k]), r1 = hn::Set(floats, rows[1].elements[k]),
               r2 = hn::Set(floats, rows[2].elements[k]), r3 = hn::Set(floats, rows[3].elements[k]);
    const auto tile = hn::Load(floats, tiles);
    s0 = hn::MulAdd(r0, tile, s0), s1 = hn::MulAdd(r1, tile, s1);
    s2 = hn::MulAdd(r2, tile, s2), s3 = hn::MulAdd(r3, tile, s3);
    if (kTiles == 1) continue;
    const auto next = hn::Load(floats, second);
    t0 = hn::MulAdd(r0, next, t0), t1 = hn::MulAdd(r1, next, t1);
    t2 = hn::MulAdd(r2, next, t2), t3 = hn::MulAdd(r3, next, t3);
  }
  products[0] = s0, products[1] = s1, products[2] = s2, products[3] = s3;
  if (kTiles == 1) return;
  products[4] = t0, products[5] = t1, products[6] = t2, products[7] = t3;
}

HWY_INLINE const std::uint8_t* elementsOf(const LocalFeatures& features, std::size_t i, const Row*) {
  return features.bytes(i);
}
HWY_INLINE const float* elementsOf(const LocalFeatures& features, std::size_t i, const FloatRow*) {
  return features.floats(i);
}

/// The two nearest of each lane; or the nearest alone.
template <bool kTwo>
struct Lanes {
  hn::Vec<Floats> best;
  hn::Vec<Floats> second;
  hn::Vec<Ints> index;

  HWY_INLINE void offer(hn::Vec<Floats> cosine, hn::Vec<Ints> candidate) {
    const auto better = hn::Gt(cosine, best);
    if (kTwo) second = hn::IfThenElse(better, best, hn::Max(second, cosine));
    best = hn::IfThenElse(better, cosine, best);
    index = hn::IfThenElse(hn::RebindMask(Ints(), better), candidate, index);
  }
};

template <bool kTwo>
HWY_INLINE Lanes<kTwo> noLanes() {
  return {hn::Set(Floats(), -1.0F), hn::Set(Floats(), -1.0F), hn::Zero(Ints())};
}

/// The two nearest over all lanes; of equals the lane with the lowest index.
template <bool kTwo>
HWY_INLINE TwoNearest reduce(const Lanes<kTwo>& lanes) {
  const Floats floats;
  const Ints ints;
  const auto best = hn::MaxOfLanes(floats, lanes.best);
  const auto is_best = hn::RebindMask(ints, hn::Eq(lanes.best, best));
  const auto index = hn::MinOfLanes(ints, hn::IfThenElse(is_best, lanes.index, hn::Set(ints, INT32_MAX)));
  if (!kTwo) return {hn::GetLane(best), -1.0F, static_cast<std::uint32_t>(hn::GetLane(index))};
  const auto winner = hn::RebindMask(floats, hn::And(is_best, hn::Eq(lanes.index, index)));
  const auto second = hn::MaxOfLanes(floats, hn::IfThenElse(winner, lanes.second, lanes.best));
  return {hn::GetLane(best), hn::GetLane(second), static_cast<std::uint32_t>(hn::GetLane(index))};
}

/// Rows of the image: from that of the highest of some features to that of the lowest.
struct Rows {
  float first_px = std::numeric_limits<float>::infinity();
  float last_px = -std::numeric_limits<float>::infinity();

  HWY_INLINE void add(const Rows& more) {
    first_px = HWY_MIN(more.first_px, first_px);
    last_px = HWY_MAX(more.last_px, last_px);
  }
  HWY_INLINE bool isWithin(float max_dy_px, const Rows& other) const {
    return first_px - other.last_px <= max_dy_px && other.first_px - last_px <= max_dy_px;
  }
};

/// Memory that is kept from call to call: for each descriptor of A, filled up to whole tiles, ...
template <class Element>
struct Workspace {
  hwy::AlignedFreeUniquePtr<Element[]> packed;
  hwy::AlignedFreeUniquePtr<float[]> y_px;
  hwy::AlignedFreeUniquePtr<float[]> inverse_norms;
  hwy::AlignedFreeUniquePtr<float[]> best;
  hwy::AlignedFreeUniquePtr<float[]> second;
  hwy::AlignedFreeUniquePtr<std::int32_t[]> index;
  std::vector<Rows> rows;              ///< ... each tile,
  std::vector<std::uint32_t> order_a;  ///< and each image
  std::vector<std::uint32_t> order_b;
  std::size_t capacity = 0;
  std::size_t elements = 0;

  void reserve(std::size_t count, std::size_t dimension) {
    if (count * dimension > elements) {
      elements = 2 * count * dimension;
      packed = hwy::AllocateAligned<Element>(elements);
    }
    if (count <= capacity) return;
    capacity = 2 * count;
    y_px = hwy::AllocateAligned<float>(capacity);
    inverse_norms = hwy::AllocateAligned<float>(capacity);
    best = hwy::AllocateAligned<float>(capacity);
    second = hwy::AllocateAligned<float>(capacity);
    index = hwy::AllocateAligned<std::int32_t>(capacity);
  }
};

/// Of the whole image, or of rows no farther than `max_dy_px` and then the nearest alone: tiles that lie farther are
/// passed over.
template <bool kWhole, class RowOf, class Element>
void findNearestOf(const LocalFeatures& a, const LocalFeatures& b, float max_dy_px, NearestDescriptors& nearest) {
  const Floats floats;
  const Ints ints;
  const std::size_t lanes = hn::Lanes(ints);
  const std::size_t padded = (a.size() + lanes - 1) / lanes * lanes;
  const std::size_t dimension = a.form().dimension;
  static thread_local Workspace<Element> kept;
  Workspace<Element>& work = kept;
  work.reserve(padded, dimension);
  orderBy<kWhole>(a, work.order_a);
  orderBy<kWhole>(b, work.order_b);
  pack(a, work.order_a, lanes, padded, work.packed.get());
  work.rows.assign(padded / lanes, Rows());
  for (std::size_t i = 0; i < padded; ++i) {
    const bool is_filled = i < a.size();
    work.y_px[i] = is_filled ? a.keypoints().y_px()[work.order_a[i]] : std::numeric_limits<float>::quiet_NaN();
    work.inverse_norms[i] = is_filled ? a.inverseNorm(work.order_a[i]) : 0.0F;
    if (is_filled) work.rows[i / lanes].add({work.y_px[i], work.y_px[i]});
    work.best[i] = work.second[i] = -1.0F;
    work.index[i] = 0;
  }
  nearest.of_a.assign(a.size(), TwoNearest());
  nearest.of_b.assign(b.size(), TwoNearest());
  RowOf rows[kRows];
  float y_px[kRows] = {};
  float inverse_norms[kRows] = {};
  for (std::size_t first = 0; first < b.size() && padded > 0; first += kRows) {
    const std::size_t count = HWY_MIN(kRows, b.size() - first);
    Rows of_rows;
    for (std::size_t r = 0; r < count; ++r) {
      const std::uint32_t of_b = work.order_b[first + r];
      rows[r].set(elementsOf(b, of_b, rows));
      y_px[r] = b.keypoints().y_px()[of_b];
      inverse_norms[r] = b.inverseNorm(of_b);
      of_rows.add({y_px[r], y_px[r]});
    }
    for (std::size_t r = count; r < kRows; ++r) rows[r] = rows[0];
    Lanes<kWhole> of_row[kRows] = {noLanes<kWhole>(), noLanes<kWhole>(), noLanes<kWhole>(), noLanes<kWhole>()};
    const auto offerTile = [&](std::size_t i, const hn::Vec<Floats>* products) HWY_ATTR {
      const auto tile_inverse_norms = hn::Load(floats, work.inverse_norms.get() + i);
      const auto tile_y_px = hn::Load(floats, work.y_px.get() + i);
      Lanes<kWhole> of_tile = noLanes<kWhole>();
      of_tile.best = hn::Load(floats, work.best.get() + i);
      if (kWhole) of_tile.second = hn::Load(floats, work.second.get() + i);
      of_tile.index = hn::Load(ints, work.index.get() + i);
      const auto filled = hn::FirstN(floats, a.size() - i);
      const auto indices = hn::Iota(ints, static_cast<std::int32_t>(i));
      for (std::size_t r = 0; r < count; ++r) {
        const auto product = hn::Mul(hn::Mul(products[r], tile_inverse_norms), hn::Set(floats, inverse_norms[r]));
        const auto dy_px = hn::Abs(hn::Sub(tile_y_px, hn::Set(floats, y_px[r])));
        const auto used = kWhole ? filled : hn::Le(dy_px, hn::Set(floats, max_dy_px));
        const auto cosine = hn::IfThenElse(used, product, hn::Set(floats, -1.0F));
        of_row[r].offer(cosine, indices);
        of_tile.offer(cosine, hn::Set(ints, static_cast<std::int32_t>(first + r)));
      }
      hn::Store(of_tile.best, floats, work.best.get() + i);
      if (kWhole) hn::Store(of_tile.second, floats, work.second.get() + i);
      hn::Store(of_tile.index, ints, work.index.get() + i);
    };
    hn::Vec<Floats> products[2 * kRows];
    for (std::size_t i = 0; i < padded; i += 2 * lanes) {
      const bool has_next = i + lanes < padded;
      Rows of_tiles = work.rows[i / lanes];
      if (has_next) of_tiles.add(work.rows[i / lanes + 1]);
      if (!kWhole && !of_tiles.isWithin(max_dy_px, of_rows)) continue;
      if (has_next) {
        multiply<2>(rows, work.packed.get() + i * dimension, dimension, products);
        offerTile(i, products);
        offerTile(i + lanes, products + kRows);
      } else {
        multiply<1>(rows, work.packed.get() + i * dimension, dimension, products);
        offerTile(i, products);
      }
    }
    for (std::size_t r = 0; r < count; ++r) {
      TwoNearest found = reduce(of_row[r]);
      found.index = work.order_a[found.index];
      nearest.of_b[work.order_b[first + r]] = found;
    }
  }
  for (std::size_t i = 0; i < a.size() && !b.empty(); ++i) {
    const std::uint32_t index = work.order_b[static_cast<std::size_t>(work.index[i])];
    nearest.of_a[work.order_a[i]] = {work.best[i], work.second[i], index};
  }
}

void findNearestImpl(const LocalFeatures& a, const LocalFeatures& b, NearestDescriptors& nearest) {
  if (a.form().element == DescriptorElement::kFloat) {
    findNearestOf<true, FloatRow, float>(a, b, 0.0F, nearest);
  } else if (a.form().dimension == kPackedBytes) {
    findNearestOf<true, Row, Packed>(a, b, 0.0F, nearest);
  } else {
    findNearestPlain(a, b, nearest);
  }
}

void findNearestWithinImpl(const LocalFeatures& a, const LocalFeatures& b, float max_dy_px,
                           NearestDescriptors& nearest) {
  if (a.form().element == DescriptorElement::kFloat) {
    findNearestOf<false, FloatRow, float>(a, b, max_dy_px, nearest);
  } else if (a.form().dimension == kPackedBytes) {
    findNearestOf<false, Row, Packed>(a, b, max_dy_px, nearest);
  } else {
    findNearestWithinPlain(a, b, max_dy_px, nearest);
  }
}

#endif  // HWY_SCALAR

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace visual_localization
#if HWY_TARGET == HWY_AVX3_DL
HWY_POP_ATTRIBUTES
#endif
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace visual_localization {

HWY_EXPORT(findNearestImpl);
HWY_EXPORT(findNearestWithinImpl);

void findNearest(const LocalFeatures& a, const LocalFeatures& b, NearestDescriptors& nearest) {
  requireAlike(a, b);
  HWY_DYNAMIC_DISPATCH(findNearestImpl)(a, b, nearest);
}

void findNearestWithin(const LocalFeatures& a, const LocalFeatures& b, float max_dy_px, NearestDescriptors& nearest) {
  requireAlike(a, b);
  HWY_DYNAMIC_DISPATCH(findNearestWithinImpl)(a, b, max_dy_px, nearest);
}

}  // namespace visual_localization
#endif
