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

/// The four bytes at `group` in each lane.
HWY_INLINE hn::Vec<Ints> broadcast(const void* group) {
  std::int32_t bits = 0;
  std::memcpy(&bits, group, sizeof(bits));
  return hn::Set(Ints(), bits);
}

/// Four bins, or their halves.
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

  static constexpr std::size_t groups(std::size_t /*dimension*/) { return kBins / kGroup; }

  alignas(4) Packed packed[kBins];
  std::int32_t correction = 0;  ///< what the packing took away from each scalar product

  HWY_INLINE void set(const std::uint8_t* descriptor) {
#if HWY_TARGET == HWY_AVX3_DL
    const __m512i ones = _mm512_set1_epi8(1);
    __m512i sum = _mm512_setzero_si512();
    for (std::size_t i = 0; i < kBins; i += sizeof(sum)) {
      __m512i bins = _mm512_loadu_si512(descriptor + i);
      if (kHalved) bins = _mm512_and_si512(_mm512_srli_epi16(bins, 1), _mm512_set1_epi8(0x7F));
      _mm512_storeu_si512(packed + i, bins);
      sum = _mm512_dpbusd_epi32(sum, bins, ones);
    }
    if (!kHalved) correction = 128 * _mm512_reduce_add_epi32(sum);
#else
    for (std::size_t i = 0; i < kBins; i += kGroup) pack(descriptor + i, packed + i);
#endif
  }
  HWY_INLINE hn::Vec<Ints> group(std::size_t i) const { return broadcast(packed + i * kGroup); }

  /// The scalar products of a row with a tile, of which some CPUs add the odd groups apart.
  struct Sum {
    hn::Vec<Ints> sum;
    hn::Vec<Ints> odd;

    HWY_INLINE explicit Sum(const ByteRow& row) : sum(hn::Set(Ints(), row.correction)), odd(hn::Zero(Ints())) {}
    HWY_INLINE void add(hn::Vec<Ints> row, const Packed* tile) {
#if HWY_TARGET == HWY_AVX3_DL
      sum = hn::Vec<Ints>{_mm512_dpbusd_epi32(sum.raw, row.raw, _mm512_load_si512(tile))};
#else
      sum = hn::ReorderWidenMulAccumulate(Ints(), hn::BitCast(Shorts(), row), hn::Load(Shorts(), tile), sum, odd);
#endif
    }
    HWY_INLINE hn::Vec<Floats> total() const {
#if HWY_TARGET == HWY_AVX3_DL
      return hn::ConvertTo(Floats(), sum);
#else
      return hn::ConvertTo(Floats(), hn::RearrangeToOddPlusEven(sum, odd));
#endif
    }
  };
};

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
  static constexpr std::size_t groups(std::size_t /*dimension*/) { return kBins / kGroup; }
  static HWY_INLINE void pack(const std::uint8_t* bins, Packed* to) {
    const std::uint32_t four = fourBins<true>(bins);
    std::memcpy(to, &four, sizeof(four));
  }

  alignas(4) Packed packed[kBins];
  HWY_INLINE void set(const std::uint8_t* descriptor) {
    for (std::size_t i = 0; i < kBins; i += kGroup) pack(descriptor + i, packed + i);
  }
  HWY_INLINE hn::Vec<Ints> group(std::size_t i) const { return broadcast(packed + i * kGroup); }

  struct Sum {
    hn::Vec<Words> sum;  ///< two a lane

    HWY_INLINE explicit Sum(const NarrowRow& /*row*/) : sum(hn::Zero(Words())) {}
    HWY_INLINE void add(hn::Vec<Ints> row, const Packed* tile) {
      const auto bins = hn::Load(Bytes(), tile);
#if HWY_TARGET == HWY_AVX3
      const hn::Vec<Words> pairs{_mm512_maddubs_epi16(bins.raw, row.raw)};
#elif HWY_TARGET == HWY_AVX2
      const hn::Vec<Words> pairs{_mm256_maddubs_epi16(bins.raw, row.raw)};
#else
      const hn::Vec<Words> pairs{_mm_maddubs_epi16(bins.raw, row.raw)};
#endif
      sum = hn::Add(sum, pairs);
    }
    HWY_INLINE hn::Vec<Floats> total() const {
      const hn::RebindToUnsigned<Ints> lanes;
      const auto both = hn::BitCast(lanes, sum);
      const auto whole = hn::Add(hn::And(both, hn::Set(lanes, 0xFFFFU)), hn::ShiftRight<16>(both));
      return hn::ConvertTo(Floats(), hn::BitCast(Ints(), whole));
    }
  };
};
#endif

/// Of descriptors of floats.
struct FloatRow {
  using Packed = float;
  static constexpr std::size_t kGroup = 1;
  static std::size_t groups(std::size_t dimension) { return dimension; }

  const float* elements = nullptr;
  HWY_INLINE void set(const float* descriptor) { elements = descriptor; }
  HWY_INLINE hn::Vec<Floats> group(std::size_t i) const { return hn::Set(Floats(), elements[i]); }

  struct Sum {
    hn::Vec<Floats> sum;

    HWY_INLINE explicit Sum(const FloatRow& /*row*/) : sum(hn::Zero(Floats())) {}
    HWY_INLINE void add(hn::Vec<Floats> row, const Packed* tile) {
      sum = hn::MulAdd(row, hn::Load(Floats(), tile), sum);
    }
    HWY_INLINE hn::Vec<Floats> total() const { return sum; }
  };
};

/// Scalar products of kRows rows with `kTiles` tiles, one lane each: those of the first tile, then of the second. Two
/// tiles at a time keep eight sums going, enough to hide how long one step takes.
template <std::size_t kTiles, class Row>
HWY_INLINE void multiply(const Row* rows, const typename Row::Packed* tiles, std::size_t dimension,
                         hn::Vec<Floats>* products) {
  using Sum = typename Row::Sum;
  const std::size_t step = hn::Lanes(Ints()) * Row::kGroup;
  const std::size_t groups = Row::groups(dimension);
  const typename Row::Packed* second = tiles + (kTiles - 1) * groups * step;
  Sum s0(rows[0]), s1(rows[1]), s2(rows[2]), s3(rows[3]);
  Sum t0 = s0, t1 = s1, t2 = s2, t3 = s3;
  for (std::size_t i = 0; i < groups; ++i, tiles += step, second += step) {
    const auto r0 = rows[0].group(i), r1 = rows[1].group(i), r2 = rows[2].group(i), r3 = rows[3].group(i);
    s0.add(r0, tiles), s1.add(r1, tiles), s2.add(r2, tiles), s3.add(r3, tiles);
    if (kTiles == 1) continue;
    t0.add(r0, second), t1.add(r1, second), t2.add(r2, second), t3.add(r3, second);
  }
  products[0] = s0.total(), products[1] = s1.total(), products[2] = s2.total(), products[3] = s3.total();
  if (kTiles == 1) return;
  products[4] = t0.total(), products[5] = t1.total(), products[6] = t2.total(), products[7] = t3.total();
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
    for (std::size_t k = 0; k < kBins; k += Row::kGroup) Row::pack(from + k, tile + k * lanes);
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
