// Scalar products of every descriptor of one image with every one of another, for each kind of CPU: see highway.h.
#if defined(VISUAL_LOCALIZATION_SCALAR_PRODUCTS_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef VISUAL_LOCALIZATION_SCALAR_PRODUCTS_INL_H
#undef VISUAL_LOCALIZATION_SCALAR_PRODUCTS_INL_H
#else
#define VISUAL_LOCALIZATION_SCALAR_PRODUCTS_INL_H
#endif

#include <cmath>
#include <cstdint>
#include <cstring>
#include <vector>

#include "features/nearest_descriptors.h"

HWY_BEFORE_NAMESPACE();
#if HWY_TARGET == HWY_AVX3_DL
HWY_PUSH_ATTRIBUTES("avx512vnni")  // which Highway asks of such a CPU, but does not tell the compiler
#endif
namespace visual_localization {
namespace HWY_NAMESPACE {
namespace {

#if HWY_TARGET != HWY_SCALAR
namespace hn = hwy::HWY_NAMESPACE;

using Ints = hn::ScalableTag<std::int32_t>;
using Floats = hn::ScalableTag<float>;
using Shorts = hn::Repartition<std::int16_t, Ints>;

constexpr std::size_t kBins = kPackedBytes;
constexpr std::size_t kRows = 4;  ///< of B at a time: each load of a tile serves so many scalar products

HWY_INLINE hn::Vec<Floats> toFloats(hn::Vec<Ints> sum) { return hn::ConvertTo(Floats(), sum); }

/// Four bins, halved if they are.
template <bool kHalved>
HWY_INLINE std::uint32_t fourBins(const std::uint8_t* bins) {
  std::uint32_t four = 0;
  std::memcpy(&four, bins, sizeof(four));
  return kHalved ? (four >> 1) & 0x7F7F7F7FU : four;
}

/// Descriptors of one image stand side by side, so that one vector instruction takes a step in as many scalar products
/// as it has lanes: for each tile of that many descriptors, for each group of bins, the groups of all of them. A row is
/// one descriptor of the other image, every group of which meets all lanes of a tile at once.
///
/// CPUs with VNNI multiply four unsigned by four signed bytes in a step, so there a group is four bins minus 128, and
/// the difference, 128 times the sum of the other descriptor, is added back. All others multiply two 16-bit numbers.
/// `kHalved`: of halved bins.
template <bool kHalved>
struct ByteRow {
#if HWY_TARGET == HWY_AVX3_DL
  using Packed = std::uint8_t;
  static constexpr std::size_t kGroup = 4;
  static HWY_INLINE void pack(const std::uint8_t* bins, Packed* to) {
    const std::uint32_t four = fourBins<kHalved>(bins) ^ (kHalved ? 0U : 0x80808080U);
    std::memcpy(to, &four, sizeof(four));
  }
#else
  using Packed = std::int16_t;
  static constexpr std::size_t kGroup = 2;
  static HWY_INLINE void pack(const std::uint8_t* bins, Packed* to) {
    for (std::size_t i = 0; i < kGroup; ++i) to[i] = static_cast<Packed>(kHalved ? bins[i] >> 1 : bins[i]);
  }
#endif
  static constexpr std::size_t kGroups = kBins / kGroup;

  alignas(4) Packed groups[kBins];
  std::int32_t correction = 0;  ///< what the packing took away from each scalar product

  HWY_INLINE void set(const std::uint8_t* descriptor) {
#if HWY_TARGET == HWY_AVX3_DL
    const __m512i ones = _mm512_set1_epi8(1);
    __m512i sum = _mm512_setzero_si512();
    for (std::size_t i = 0; i < kBins; i += sizeof(sum)) {
      __m512i bins = _mm512_loadu_si512(descriptor + i);
      if (kHalved) bins = _mm512_and_si512(_mm512_srli_epi16(bins, 1), _mm512_set1_epi8(0x7F));
      _mm512_storeu_si512(groups + i, bins);
      sum = _mm512_dpbusd_epi32(sum, bins, ones);
    }
    if (!kHalved) correction = 128 * _mm512_reduce_add_epi32(sum);
#else
    for (std::size_t i = 0; i < kBins; ++i)
      groups[i] = static_cast<Packed>(kHalved ? descriptor[i] >> 1 : descriptor[i]);
#endif
  }
};

template <class Row>
HWY_INLINE hn::Vec<Ints> broadcast(const Row& row, std::size_t group) {
  std::int32_t bits = 0;
  std::memcpy(&bits, row.groups + group * Row::kGroup, sizeof(bits));
  return hn::Set(Ints(), bits);
}

/// `sum` + the scalar products of one group with a tile's.
template <class Packed>
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

/// Scalar products of kRows rows with `kTiles` tiles, one lane each: those of the first tile, then of the second. Two
/// tiles at a time keep eight sums going, enough to hide how long one step takes.
template <std::size_t kTiles, bool kHalved>
HWY_INLINE void multiply(const ByteRow<kHalved>* rows, const typename ByteRow<kHalved>::Packed* tiles,
                         std::size_t /*dimension*/, hn::Vec<Floats>* products) {
  using Row = ByteRow<kHalved>;
  const Ints ints;
  const std::size_t step = hn::Lanes(ints) * Row::kGroup;
  const auto* second = tiles + (kTiles - 1) * Row::kGroups * step;
  hn::Vec<Ints> s0 = hn::Set(ints, rows[0].correction), s1 = hn::Set(ints, rows[1].correction),
                s2 = hn::Set(ints, rows[2].correction), s3 = hn::Set(ints, rows[3].correction);
  hn::Vec<Ints> t0 = s0, t1 = s1, t2 = s2, t3 = s3;
  hn::Vec<Ints> o0 = hn::Zero(ints), o1 = o0, o2 = o0, o3 = o0, p0 = o0, p1 = o0, p2 = o0, p3 = o0;
  for (std::size_t group = 0; group < Row::kGroups; ++group, tiles += step, second += step) {
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

#undef VISUAL_LOCALIZATION_NARROW
#if HWY_TARGET == HWY_SSSE3 || HWY_TARGET == HWY_SSE4 || HWY_TARGET == HWY_AVX2 || HWY_TARGET == HWY_AVX3
#define VISUAL_LOCALIZATION_NARROW

using Words = hn::Repartition<std::uint16_t, Ints>;
using Bytes = hn::Repartition<std::uint8_t, Ints>;

/// Halved bins as bytes, for CPUs that add the products of two pairs in 16 bits: those of halves fit. So do the scalar
/// products of the first and of the second pairs of all groups, which are summed apart, where the squared norms of
/// these of both descriptors multiplied are below 2^32, by Cauchy and Schwarz. Not for others.
struct NarrowRow {
  static constexpr std::uint64_t kMostSquared = std::uint64_t{1} << 32;
  using Packed = std::uint8_t;
  static constexpr std::size_t kGroup = 4;
  static constexpr std::size_t kGroups = kBins / kGroup;
  static HWY_INLINE void pack(const std::uint8_t* bins, Packed* to) {
    const std::uint32_t four = fourBins<true>(bins);
    std::memcpy(to, &four, sizeof(four));
  }

  alignas(4) Packed groups[kBins];
  HWY_INLINE void set(const std::uint8_t* descriptor) {
    for (std::size_t group = 0; group < kGroups; ++group) pack(descriptor + group * kGroup, groups + group * kGroup);
  }
};

HWY_INLINE hn::Vec<Words> multiplyAdd(hn::Vec<Ints> row, hn::Vec<Bytes> tile, hn::Vec<Words> sum) {
#if HWY_TARGET == HWY_AVX3
  const hn::Vec<Words> pairs{_mm512_maddubs_epi16(tile.raw, row.raw)};
#elif HWY_TARGET == HWY_AVX2
  const hn::Vec<Words> pairs{_mm256_maddubs_epi16(tile.raw, row.raw)};
#else
  const hn::Vec<Words> pairs{_mm_maddubs_epi16(tile.raw, row.raw)};
#endif
  return hn::Add(sum, pairs);
}

/// Of both halves of each lane.
HWY_INLINE hn::Vec<Floats> total(hn::Vec<Words> sum) {
  const Ints ints;
  const auto both = hn::BitCast(hn::RebindToUnsigned<Ints>(), sum);
  const auto low = hn::And(both, hn::Set(hn::RebindToUnsigned<Ints>(), 0xFFFFU));
  return toFloats(hn::BitCast(ints, hn::Add(low, hn::ShiftRight<16>(both))));
}

template <std::size_t kTiles>
HWY_INLINE void multiply(const NarrowRow* rows, const std::uint8_t* tiles, std::size_t /*dimension*/,
                         hn::Vec<Floats>* products) {
  const Bytes bytes;
  const std::size_t step = hn::Lanes(bytes);
  const std::uint8_t* second = tiles + (kTiles - 1) * NarrowRow::kGroups * step;
  hn::Vec<Words> s0 = hn::Zero(Words()), s1 = s0, s2 = s0, s3 = s0, t0 = s0, t1 = s0, t2 = s0, t3 = s0;
  for (std::size_t group = 0; group < NarrowRow::kGroups; ++group, tiles += step, second += step) {
    const auto r0 = broadcast(rows[0], group), r1 = broadcast(rows[1], group), r2 = broadcast(rows[2], group),
               r3 = broadcast(rows[3], group);
    const auto tile = hn::Load(bytes, tiles);
    s0 = multiplyAdd(r0, tile, s0), s1 = multiplyAdd(r1, tile, s1);
    s2 = multiplyAdd(r2, tile, s2), s3 = multiplyAdd(r3, tile, s3);
    if (kTiles == 1) continue;
    const auto next = hn::Load(bytes, second);
    t0 = multiplyAdd(r0, next, t0), t1 = multiplyAdd(r1, next, t1);
    t2 = multiplyAdd(r2, next, t2), t3 = multiplyAdd(r3, next, t3);
  }
  products[0] = total(s0), products[1] = total(s1), products[2] = total(s2), products[3] = total(s3);
  if (kTiles == 1) return;
  products[4] = total(t0), products[5] = total(t1), products[6] = total(t2), products[7] = total(t3);
}
#endif

/// Of descriptors of floats.
struct FloatRow {
  using Packed = float;
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

/// Descriptors in `order` side by side, filled up to whole tiles with zeros. `padded`: their number then.
template <class Row>
void pack(const LocalFeatures& features, const std::vector<std::uint32_t>& order, std::size_t padded,
          typename Row::Packed* to, const Row*) {
  static constexpr std::uint8_t kNone[kBins] = {};
  const std::size_t lanes = hn::Lanes(Ints());
  for (std::size_t i = 0; i < padded; ++i) {
    const std::uint8_t* from = i < features.size() ? features.bytes(order[i]) : kNone;
    typename Row::Packed* tile = to + i / lanes * lanes * kBins + i % lanes * Row::kGroup;
    for (std::size_t group = 0; group < Row::kGroups; ++group) {
      Row::pack(from + group * Row::kGroup, tile + group * lanes * Row::kGroup);
    }
  }
}

/// For each element, that of all of a tile.
HWY_INLINE void pack(const LocalFeatures& features, const std::vector<std::uint32_t>& order, std::size_t padded,
                     float* to, const FloatRow*) {
  const std::size_t lanes = hn::Lanes(Ints());
  const std::size_t dimension = features.form().dimension;
  for (std::size_t i = 0; i < padded; ++i) {
    float* tile = to + i / lanes * lanes * dimension + i % lanes;
    for (std::size_t k = 0; k < dimension; ++k) {
      tile[k * lanes] = i < features.size() ? features.floats(order[i])[k] : 0.0F;
    }
  }
}

template <class Row>
HWY_INLINE const std::uint8_t* elementsOf(const LocalFeatures& features, std::size_t i, const Row*) {
  return features.bytes(i);
}
HWY_INLINE const float* elementsOf(const LocalFeatures& features, std::size_t i, const FloatRow*) {
  return features.floats(i);
}

/// Into `inverse`: one by the norm of each descriptor of halved bytes, 0 of the zero vector. The largest squared norm
/// of the first, or of the second pairs of all groups of four bins is returned, where vectors are in the order of
/// memory.
HWY_INLINE std::uint64_t halvedNorms(const LocalFeatures& features, std::vector<float>& inverse) {
  const Ints ints;
  const Shorts shorts;
  const hn::Rebind<std::uint8_t, Shorts> bytes;
  inverse.resize(features.size());
  std::int32_t largest = 0;
  for (std::size_t i = 0; i < features.size(); ++i) {
    auto sum = hn::Zero(ints);
    auto odd = hn::Zero(ints);
    for (std::size_t k = 0; k < kBins; k += hn::Lanes(shorts)) {
      const auto halves = hn::ShiftRight<1>(hn::PromoteTo(shorts, hn::LoadU(bytes, features.bytes(i) + k)));
      sum = hn::ReorderWidenMulAccumulate(ints, halves, halves, sum, odd);
    }
    sum = hn::RearrangeToOddPlusEven(sum, odd);
    const std::int32_t squared = hn::GetLane(hn::SumOfLanes(ints, sum));
    const std::int32_t of_second = hn::GetLane(hn::SumOfLanes(ints, hn::OddEven(sum, hn::Zero(ints))));
    inverse[i] = squared > 0 ? 1.0F / std::sqrt(static_cast<float>(squared)) : 0.0F;
    largest = HWY_MAX(largest, HWY_MAX(of_second, squared - of_second));
  }
  return static_cast<std::uint64_t>(largest);
}
#endif  // HWY_SCALAR

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace visual_localization
#if HWY_TARGET == HWY_AVX3_DL
HWY_POP_ATTRIBUTES
#endif
HWY_AFTER_NAMESPACE();

#endif
