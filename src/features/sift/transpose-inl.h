// Included by Highway once for each kind of CPU.
#if defined(VISUAL_LOCALIZATION_TRANSPOSE_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef VISUAL_LOCALIZATION_TRANSPOSE_INL_H
#undef VISUAL_LOCALIZATION_TRANSPOSE_INL_H
#else
#define VISUAL_LOCALIZATION_TRANSPOSE_INL_H
#endif

#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace visual_localization {
namespace HWY_NAMESPACE {
#if HWY_TARGET != HWY_SCALAR

/// Turns a block of as many vectors as a vector has lanes (4, 8 or 16): rows in, four at a time, columns out.
template <class D>
class Transpose {
  using V = hwy::HWY_NAMESPACE::Vec<D>;
  static constexpr int kGroups = static_cast<int>(hwy::HWY_NAMESPACE::MaxLanes(D())) / 4;

 public:
  /// Rows 4 * group .. 4 * group + 3. Turns each of their 128-bit blocks.
  HWY_INLINE void put(int group, V r0, V r1, V r2, V r3) {
    namespace hn = hwy::HWY_NAMESPACE;
    const D d;
    const hn::RepartitionToWide<D> pairs;
    const auto low01 = hn::BitCast(pairs, hn::InterleaveLower(d, r0, r1));
    const auto high01 = hn::BitCast(pairs, hn::InterleaveUpper(d, r0, r1));
    const auto low23 = hn::BitCast(pairs, hn::InterleaveLower(d, r2, r3));
    const auto high23 = hn::BitCast(pairs, hn::InterleaveUpper(d, r2, r3));
    parts_[group][0] = hn::BitCast(d, hn::InterleaveLower(pairs, low01, low23));
    parts_[group][1] = hn::BitCast(d, hn::InterleaveUpper(pairs, low01, low23));
    parts_[group][2] = hn::BitCast(d, hn::InterleaveLower(pairs, high01, high23));
    parts_[group][3] = hn::BitCast(d, hn::InterleaveUpper(pairs, high01, high23));
  }

  /// Calls `use(i, column i)` for every column: gathers the blocks of each.
  template <class Use>
  HWY_INLINE void take(const Use& use) const {
    namespace hn = hwy::HWY_NAMESPACE;
    const D d;
    for (int i = 0; i < 4; ++i) {
      if constexpr (kGroups == 1) {
        use(i, parts_[0][i]);
      } else {
        const V even01 = hn::OddEvenBlocks(hn::SwapAdjacentBlocks(parts_[1][i]), parts_[0][i]);
        const V odd01 = hn::OddEvenBlocks(parts_[1][i], hn::SwapAdjacentBlocks(parts_[0][i]));
        if constexpr (kGroups == 2) {
          use(i, even01);
          use(i + 4, odd01);
        } else {
          const V even23 = hn::OddEvenBlocks(hn::SwapAdjacentBlocks(parts_[kGroups - 1][i]), parts_[kGroups - 2][i]);
          const V odd23 = hn::OddEvenBlocks(parts_[kGroups - 1][i], hn::SwapAdjacentBlocks(parts_[kGroups - 2][i]));
          use(i, hn::ConcatLowerLower(d, even23, even01));
          use(i + 4, hn::ConcatLowerLower(d, odd23, odd01));
          use(i + 8, hn::ConcatUpperUpper(d, even23, even01));
          use(i + 12, hn::ConcatUpperUpper(d, odd23, odd01));
        }
      }
    }
  }

 private:
  V parts_[kGroups][4];
};

#endif
}  // namespace HWY_NAMESPACE
}  // namespace visual_localization
HWY_AFTER_NAMESPACE();

#endif
