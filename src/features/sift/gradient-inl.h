// Included by Highway once for each kind of CPU.
#if defined(VISUAL_LOCALIZATION_GRADIENT_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef VISUAL_LOCALIZATION_GRADIENT_INL_H
#undef VISUAL_LOCALIZATION_GRADIENT_INL_H
#else
#define VISUAL_LOCALIZATION_GRADIENT_INL_H
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

}  // namespace HWY_NAMESPACE
}  // namespace visual_localization
HWY_AFTER_NAMESPACE();

#endif
