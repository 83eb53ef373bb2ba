// Included by Highway once for each kind of CPU.
#if defined(VISUAL_LOCALIZATION_GRADIENT_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef VISUAL_LOCALIZATION_GRADIENT_INL_H
#undef VISUAL_LOCALIZATION_GRADIENT_INL_H
#else
#define VISUAL_LOCALIZATION_GRADIENT_INL_H
#endif

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

template <class V>
HWY_INLINE V magnitudeOf(const Gradient<V>& gradient) {
  namespace hn = hwy::HWY_NAMESPACE;
  return hn::Sqrt(hn::MulAdd(gradient.x, gradient.x, hn::Mul(gradient.y, gradient.y)));
}

/// Direction in turns, [0, 1], counter-clockwise from the right. Arc tangent after Abramowitz and Stegun, 4.4.49:
/// wrong by less than 2e-6 turns.
template <class D, class V = hwy::HWY_NAMESPACE::Vec<D>>
HWY_INLINE V turnsOf(D d, const Gradient<V>& gradient) {
  namespace hn = hwy::HWY_NAMESPACE;
  constexpr float kTurn = 0.15915494309F;  // 1 / (2 pi)
  const V x = hn::Abs(gradient.x);
  const V y = hn::Abs(gradient.y);
  const V tangent = hn::Div(hn::Min(x, y), hn::Max(hn::Max(x, y), hn::Set(d, 1e-30F)));
  const V squared = hn::Mul(tangent, tangent);
  V sum = hn::Set(d, 0.0208351F * kTurn);
  sum = hn::MulAdd(sum, squared, hn::Set(d, -0.0851330F * kTurn));
  sum = hn::MulAdd(sum, squared, hn::Set(d, 0.1801410F * kTurn));
  sum = hn::MulAdd(sum, squared, hn::Set(d, -0.3302995F * kTurn));
  sum = hn::MulAdd(sum, squared, hn::Set(d, 0.9998660F * kTurn));
  V turns = hn::Mul(sum, tangent);
  turns = hn::IfThenElse(hn::Gt(y, x), hn::Sub(hn::Set(d, 0.25F), turns), turns);
  turns = hn::IfThenElse(hn::Lt(gradient.x, hn::Zero(d)), hn::Sub(hn::Set(d, 0.5F), turns), turns);
  return hn::IfThenElse(hn::Lt(gradient.y, hn::Zero(d)), hn::Sub(hn::Set(d, 1.0F), turns), turns);
}

}  // namespace HWY_NAMESPACE
}  // namespace visual_localization
HWY_AFTER_NAMESPACE();

#endif
