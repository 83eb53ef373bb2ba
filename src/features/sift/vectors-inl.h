// Gradients and transposition for a whole vector of pixels. Included by Highway once for each kind of CPU.
#if defined(VISUAL_LOCALIZATION_VECTORS_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef VISUAL_LOCALIZATION_VECTORS_INL_H
#undef VISUAL_LOCALIZATION_VECTORS_INL_H
#else
#define VISUAL_LOCALIZATION_VECTORS_INL_H
#endif

#include <cstddef>
#include <cstdint>

#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace visual_localization {
namespace HWY_NAMESPACE {

/// Twice the gradient of an image at as many pixels of a row as a vector has lanes.
template <class V>
struct Gradient {
  V x;  ///< to the right
  V y;  ///< up
};

template <class D, class V = hwy::HWY_NAMESPACE::Vec<D>>
HWY_INLINE Gradient<V> gradientAt(D d, const float* row, std::ptrdiff_t stride) {
  namespace hn = hwy::HWY_NAMESPACE;
  return {hn::Sub(hn::LoadU(d, row + 1), hn::LoadU(d, row - 1)),
          hn::Sub(hn::LoadU(d, row - stride), hn::LoadU(d, row + stride))};
}

/// Levels are larger than the caches and read in pieces of rows, which the CPU does not foresee.
constexpr int kRowsAhead = 8;

/// Twice the gradient by length and direction.
template <class V>
struct PolarGradient {
  V magnitude;
  V turns;  ///< [0, 1], counter-clockwise from the right
};

/// Without division or square root: 1 / length from the CPU's estimate and one step of Newton's, the direction from
/// the arc sine of the shorter component, at most half a right angle. Its polynomial was fitted to the least largest
/// error, 3e-6 turns.
template <class D, class V = hwy::HWY_NAMESPACE::Vec<D>>
HWY_INLINE PolarGradient<V> polarGradientAt(D d, const float* row, std::ptrdiff_t stride) {
  namespace hn = hwy::HWY_NAMESPACE;
  const Gradient<V> gradient = gradientAt(d, row, stride);
  const V x = hn::Abs(gradient.x);
  const V y = hn::Abs(gradient.y);
  const V squared = hn::MulAdd(x, x, hn::MulAdd(y, y, hn::Set(d, 1e-12F)));
  const V estimate = hn::ApproximateReciprocalSqrt(squared);
  const V correction = hn::NegMulAdd(hn::Mul(squared, hn::Set(d, 0.5F)), hn::Mul(estimate, estimate), hn::Set(d, 1.5F));
  const V inverse = hn::Mul(estimate, correction);
  const V sine = hn::Mul(hn::Min(x, y), inverse);
  const V sine_squared = hn::Mul(sine, sine);
  V turns = hn::MulAdd(hn::Set(d, 0.0188094804F), sine_squared, hn::Set(d, 0.00640179668F));
  turns = hn::MulAdd(turns, sine_squared, hn::Set(d, 0.0274048505F));
  turns = hn::MulAdd(turns, sine_squared, hn::Set(d, 0.159118361F));
  turns = hn::Mul(turns, sine);
  turns = hn::IfThenElse(hn::Gt(y, x), hn::Sub(hn::Set(d, 0.25F), turns), turns);
  turns = hn::IfThenElse(hn::Lt(gradient.x, hn::Zero(d)), hn::Sub(hn::Set(d, 0.5F), turns), turns);
  turns = hn::IfThenElse(hn::Lt(gradient.y, hn::Zero(d)), hn::Sub(hn::Set(d, 1.0F), turns), turns);
  return {hn::Mul(squared, inverse), turns};
}

/// Small numbers of at least zero, rounded to whole ones: adding 2^23 leaves them in the last bits, which is faster
/// than a conversion that minds the large.
template <class D, class V = hwy::HWY_NAMESPACE::Vec<D>>
HWY_INLINE hwy::HWY_NAMESPACE::Vec<hwy::HWY_NAMESPACE::RebindToSigned<D>> smallInteger(D d, V value) {
  namespace hn = hwy::HWY_NAMESPACE;
  const hn::RebindToSigned<D> ints;
  constexpr float kShift = 8388608.0F;
  constexpr std::int32_t kBits = (1 << 22) - 1;
  return hn::And(hn::BitCast(ints, hn::Add(value, hn::Set(d, kShift))), hn::Set(ints, kBits));
}

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
