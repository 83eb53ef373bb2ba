// Compiled once for each kind of CPU, see highway.h.
#define VISUAL_LOCALIZATION_WANT_VNNI
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "features/nearest_descriptors.cpp"
#include "features/nearest_descriptors.h"

#include <algorithm>
#include <limits>
#include <numeric>
#include <vector>

#include "features/highway.h"
#include "features/scalar_products-inl.h"

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

template <bool kWhole>
void orderBy(const LocalFeatures& features, std::vector<std::uint32_t>& order) {
  if (!kWhole) return orderByRow(features, order);
  order.resize(features.size());
  std::iota(order.begin(), order.end(), 0U);
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

/// Memory that is kept from call to call. Of A, which is often compared with one B after the other: ...
template <class Row>
struct Workspace {
  LocalFeatures a;  ///< a copy, by which it is known again
  bool is_packed = false;
  hwy::AlignedFreeUniquePtr<typename Row::Packed[]> packed;
  hwy::AlignedFreeUniquePtr<float[]> y_px;  ///< of each descriptor, filled up to whole tiles, ...
  hwy::AlignedFreeUniquePtr<float[]> inverse_norms;
  std::vector<Rows> tiles;  ///< ... each tile,
  std::vector<std::uint32_t> order_a;
  std::vector<std::uint32_t> order_b;  ///< and of the last pair
  hwy::AlignedFreeUniquePtr<float[]> best;
  hwy::AlignedFreeUniquePtr<float[]> second;
  hwy::AlignedFreeUniquePtr<std::int32_t[]> index;
  std::size_t capacity = 0;
  std::size_t elements = 0;

  void reserve(std::size_t count, std::size_t dimension) {
    if (count * dimension > elements) {
      elements = 2 * count * dimension;
      packed = hwy::AllocateAligned<typename Row::Packed>(elements);
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

/// What is packed of both is the same.
bool isSame(const LocalFeatures& one, const LocalFeatures& other) {
  return one.keypoints().y_px() == other.keypoints().y_px() && one.bytes() == other.bytes() &&
         one.floats() == other.floats();
}

/// Puts the descriptors of A side by side, unless they are.
template <bool kWhole, class Row, class InverseNorm>
void prepare(const LocalFeatures& a, InverseNorm inverse_norm, std::size_t padded, Workspace<Row>& work) {
  if (work.is_packed && isSame(a, work.a)) return;
  work.is_packed = false;
  work.reserve(padded, a.form().dimension);
  orderBy<kWhole>(a, work.order_a);
  pack(a, work.order_a, padded, work.packed.get(), static_cast<const Row*>(nullptr));
  const std::size_t lanes = hn::Lanes(Ints());
  work.tiles.assign(padded / lanes, Rows());
  for (std::size_t i = 0; i < padded; ++i) {
    const bool is_filled = i < a.size();
    work.y_px[i] = is_filled ? a.keypoints().y_px()[work.order_a[i]] : std::numeric_limits<float>::quiet_NaN();
    work.inverse_norms[i] = is_filled ? inverse_norm(work.order_a[i]) : 0.0F;
    if (is_filled) work.tiles[i / lanes].add({work.y_px[i], work.y_px[i]});
  }
  work.a = a;
  work.is_packed = true;
}

/// Of the whole image, or of rows no farther than `max_dy_px` and then the nearest alone: tiles that lie farther are
/// passed over. `inverse_norm_a`, `inverse_norm_b`: of a descriptor. Not inlined: where `work` is seen to be a thread's
/// own, its address is asked for in each tile.
template <bool kWhole, class Row, class InverseNorm>
HWY_NOINLINE void findNearestIn(Workspace<Row>& work, const LocalFeatures& a, const LocalFeatures& b,
                                InverseNorm inverse_norm_a, InverseNorm inverse_norm_b, float max_dy_px,
                                NearestDescriptors& nearest) {
  const Floats floats;
  const Ints ints;
  const std::size_t lanes = hn::Lanes(ints);
  const std::size_t padded = (a.size() + lanes - 1) / lanes * lanes;
  const std::size_t dimension = a.form().dimension;
  prepare<kWhole>(a, inverse_norm_a, padded, work);
  orderBy<kWhole>(b, work.order_b);
  std::fill_n(work.best.get(), padded, -1.0F);
  std::fill_n(work.second.get(), padded, -1.0F);
  std::fill_n(work.index.get(), padded, 0);
  nearest.of_a.assign(a.size(), TwoNearest());
  nearest.of_b.assign(b.size(), TwoNearest());
  Row rows[kRows];
  float y_px[kRows] = {};
  float inverse_norms[kRows] = {};
  for (std::size_t first = 0; first < b.size() && padded > 0; first += kRows) {
    const std::size_t count = HWY_MIN(kRows, b.size() - first);
    Rows of_rows;
    for (std::size_t r = 0; r < count; ++r) {
      const std::uint32_t of_b = work.order_b[first + r];
      rows[r].set(elementsOf(b, of_b, rows));
      y_px[r] = b.keypoints().y_px()[of_b];
      inverse_norms[r] = inverse_norm_b(of_b);
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
      Rows of_tiles = work.tiles[i / lanes];
      if (has_next) of_tiles.add(work.tiles[i / lanes + 1]);
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

template <bool kWhole, class Row, class InverseNorm>
void findNearestOf(const LocalFeatures& a, const LocalFeatures& b, InverseNorm inverse_norm_a,
                   InverseNorm inverse_norm_b, float max_dy_px, NearestDescriptors& nearest) {
  static thread_local Workspace<Row> work;
  findNearestIn<kWhole>(work, a, b, inverse_norm_a, inverse_norm_b, max_dy_px, nearest);
}

struct OwnNorm {
  const LocalFeatures& features;
  float operator()(std::size_t i) const { return features.inverseNorm(i); }
};

struct HalvedNorm {
  const std::vector<float>& inverse_norms;
  float operator()(std::size_t i) const { return inverse_norms[i]; }
};

void findNearestImpl(const LocalFeatures& a, const LocalFeatures& b, NearestDescriptors& nearest) {
  if (a.form().element == DescriptorElement::kFloat) {
    findNearestOf<true, FloatRow>(a, b, OwnNorm{a}, OwnNorm{b}, 0.0F, nearest);
  } else if (a.form().dimension == kPackedBytes) {
    findNearestOf<true, ByteRow<false> >(a, b, OwnNorm{a}, OwnNorm{b}, 0.0F, nearest);
  } else {
    findNearestPlain(a, b, nearest);
  }
}

void findHalvedWithin(const LocalFeatures& a, const LocalFeatures& b, float max_dy_px, NearestDescriptors& nearest) {
  static thread_local std::vector<float> inverse_norms_a;
  static thread_local std::vector<float> inverse_norms_b;
  const std::uint64_t largest_a = halvedNorms(a, inverse_norms_a);
  const std::uint64_t largest_b = halvedNorms(b, inverse_norms_b);
  const HalvedNorm norm_a{inverse_norms_a};
  const HalvedNorm norm_b{inverse_norms_b};
#ifdef VISUAL_LOCALIZATION_NARROW
  if (largest_a * largest_b < NarrowRow::kMostSquared) {
    return findNearestOf<false, NarrowRow>(a, b, norm_a, norm_b, max_dy_px, nearest);
  }
#else
  (void)largest_a, (void)largest_b;
#endif
  findNearestOf<false, ByteRow<true> >(a, b, norm_a, norm_b, max_dy_px, nearest);
}

void findNearestWithinImpl(const LocalFeatures& a, const LocalFeatures& b, float max_dy_px,
                           NearestDescriptors& nearest) {
  if (a.form().element == DescriptorElement::kFloat) {
    findNearestOf<false, FloatRow>(a, b, OwnNorm{a}, OwnNorm{b}, max_dy_px, nearest);
  } else if (a.form().dimension == kPackedBytes) {
    findHalvedWithin(a, b, max_dy_px, nearest);
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
