// SPDX-License-Identifier: Apache-2.0

// The factor by which the finite pulse of a contact changes what an impulse adds to each mode,
// compiled for each target. The factor of a Gaussian pulse is exp(tau^2 s^2/2), which
// strike_kernel.cc multiplies into the delay. Only kernels include this file, within
// foreach_target.
#if defined(CARILLON_SERVER_SYNTHESIS_PULSE_FACTOR_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef CARILLON_SERVER_SYNTHESIS_PULSE_FACTOR_INL_H_
#undef CARILLON_SERVER_SYNTHESIS_PULSE_FACTOR_INL_H_
#else
#define CARILLON_SERVER_SYNTHESIS_PULSE_FACTOR_INL_H_
#endif

#include <hwy/highway.h>

#include "server/synthesis/ringing/lane_arrays.h"
#include "server/synthesis/ringing/lane_vectors-inl.h"

HWY_BEFORE_NAMESPACE();
namespace carillon::HWY_NAMESPACE {

/// Sine and cosine at once, to 1e-7 for |angle| up to some thousands: reduced to a quarter of a
/// cycle in three parts (Cody and Waite), then the series of each, telescoped.
HWY_INLINE void SineCosine(V angle, V& sine, V& cosine) {
  const Floats d;
  const hn::RebindToSigned<Floats> di;
  const V turns = hn::Round(hn::Mul(angle, hn::Set(d, 0.636619772F)));
  V r = hn::NegMulAdd(turns, hn::Set(d, 1.5703125F), angle);
  r = hn::NegMulAdd(turns, hn::Set(d, 4.837512969970703e-4F), r);
  r = hn::NegMulAdd(turns, hn::Set(d, 7.549789948768648e-8F), r);
  const V x = hn::Mul(r, r);
  V s = hn::MulAdd(x, hn::Set(d, -1.9515295891e-4F), hn::Set(d, 8.3321608736e-3F));
  s = hn::MulAdd(s, x, hn::Set(d, -1.6666654611e-1F));
  s = hn::MulAdd(hn::Mul(s, x), r, r);
  V c = hn::MulAdd(x, hn::Set(d, 2.443315711809948e-5F), hn::Set(d, -1.388731625493765e-3F));
  c = hn::MulAdd(c, x, hn::Set(d, 4.166664568298827e-2F));
  c = hn::MulAdd(hn::Mul(c, x), x, hn::NegMulAdd(x, hn::Set(d, 0.5F), hn::Set(d, 1.0F)));
  const auto quarter = hn::ConvertTo(di, turns);
  const auto one = hn::Set(di, 1), two = hn::Set(di, 2);
  const auto odd = hn::RebindMask(d, hn::Eq(hn::And(quarter, one), one));
  const auto sine_sign = hn::ShiftLeft<30>(hn::And(quarter, two));
  const auto cosine_sign = hn::ShiftLeft<30>(hn::And(hn::Add(quarter, one), two));
  sine = hn::Xor(hn::IfThenElse(odd, c, s), hn::BitCast(d, sine_sign));
  cosine = hn::Xor(hn::IfThenElse(odd, s, c), hn::BitCast(d, cosine_sign));
}

/// (re, im) *= (by_re, by_im).
HWY_INLINE void Multiply(V by_re, V by_im, V& re, V& im) {
  const V product = hn::NegMulAdd(im, by_im, hn::Mul(re, by_re));
  im = hn::MulAdd(im, by_re, hn::Mul(re, by_im));
  re = product;
}

/// The factor sinh(x)/x / (1 + (x/pi)^2) of a raised cosine, x = a + iy, for a from -1/4 to 0 and y
/// from 0 to 9.5: to 1.1e-6. It is an entire function of x^2; this polynomial in
/// z = 1 + x^2/45.2 was fitted to it. A polynomial with real coefficients c at z = u + iv is
/// c0 + z b1 - |z|^2 b2 with b_k = c_k + 2u b_(k+1) - |z|^2 b_(k+2).
HWY_INLINE void NearCosineFactor(V a, V y, V& factor_re, V& factor_im) {
  constexpr float kCoefficients[] = {-0.0176949706F, 0.0948894173F,  0.30952841F,
                                     0.331442714F,   0.190311119F,   0.0695937276F,
                                     0.0178977884F,  0.00353869121F, 0.000492737105F};
  constexpr int kDegree = 8;
  constexpr float kPerCentre = 1 / 45.2F;
  const Floats d;
  const V u =
      hn::MulAdd(hn::NegMulAdd(y, y, hn::Mul(a, a)), hn::Set(d, kPerCentre), hn::Set(d, 1.0F));
  const V v = hn::Mul(hn::Mul(a, y), hn::Set(d, 2 * kPerCentre));
  const V twice = hn::Add(u, u);
  const V square = hn::MulAdd(u, u, hn::Mul(v, v));
  V later = hn::Set(d, kCoefficients[kDegree]);
  V b = hn::MulAdd(twice, later, hn::Set(d, kCoefficients[kDegree - 1]));
#pragma GCC unroll 8
  for (int k = kDegree - 2; k > 0; --k) {
    const V next = hn::NegMulAdd(square, later, hn::MulAdd(twice, b, hn::Set(d, kCoefficients[k])));
    later = b;
    b = next;
  }
  factor_re = hn::NegMulAdd(square, later, hn::MulAdd(u, b, hn::Set(d, kCoefficients[0])));
  factor_im = hn::Mul(v, b);
}

/// Computes the same factor for a from -2 to 0 and any y above zero. At x = i pi, where the factor
/// is 1/2, numerator and denominator vanish together, so that pi - y is computed to the last bit.
HWY_INLINE void CosineFactor(V a, V y, V& factor_re, V& factor_im) {
  const Floats d;
  const V t = hn::Mul(a, a);
  V sinh = hn::MulAdd(t, hn::Set(d, 1.0F / 39916800), hn::Set(d, 1.0F / 362880));
  sinh = hn::MulAdd(sinh, t, hn::Set(d, 1.0F / 5040));
  sinh = hn::MulAdd(sinh, t, hn::Set(d, 1.0F / 120));
  sinh = hn::MulAdd(sinh, t, hn::Set(d, 1.0F / 6));
  sinh = hn::MulAdd(hn::Mul(sinh, t), a, a);
  V cosh = hn::MulAdd(t, hn::Set(d, 1.0F / 479001600), hn::Set(d, 1.0F / 3628800));
  cosh = hn::MulAdd(cosh, t, hn::Set(d, 1.0F / 40320));
  cosh = hn::MulAdd(cosh, t, hn::Set(d, 1.0F / 720));
  cosh = hn::MulAdd(cosh, t, hn::Set(d, 1.0F / 24));
  cosh = hn::MulAdd(cosh, t, hn::Set(d, 0.5F));
  cosh = hn::MulAdd(cosh, t, hn::Set(d, 1.0F));
  V sine, cosine;
  SineCosine(y, sine, cosine);
  const V over_re = hn::Mul(sinh, cosine), over_im = hn::Mul(cosh, sine);
  // pi^2 + x^2 = u + iv, and the denominator x (u + iv)/pi^2 = under.
  constexpr float kPi = 3.14159274F, kPiRest = -8.74227766e-8F, kPerPiSquared = 0.101321184F;
  const V to_pi = hn::Add(hn::Sub(hn::Set(d, kPi), y), hn::Set(d, kPiRest));
  const V u = hn::Mul(hn::MulAdd(to_pi, hn::Add(hn::Set(d, kPi), y), t), hn::Set(d, kPerPiSquared));
  const V v = hn::Mul(hn::Mul(a, y), hn::Set(d, 2 * kPerPiSquared));
  const V under_re = hn::NegMulAdd(y, v, hn::Mul(a, u));
  const V under_im = hn::MulAdd(y, u, hn::Mul(a, v));
  const V scale =
      hn::Div(hn::Set(d, 1.0F), hn::MulAdd(under_re, under_re, hn::Mul(under_im, under_im)));
  factor_re = hn::Mul(hn::MulAdd(over_re, under_re, hn::Mul(over_im, under_im)), scale);
  factor_im = hn::Mul(hn::NegMulAdd(over_re, under_im, hn::Mul(over_im, under_re)), scale);
}

/// (re, im) *= the factor of a raised cosine of duration T, with x = s T/2.
HWY_INLINE void SpreadOverCosine(const LaneArrays& lanes, size_t lane, V half_duration, V& re,
                                 V& im) {
  const Floats d;
  // A mode that decays further than this between the middle and the end of its contact is inaudible
  // at the end, and the factor would make it loud before the end.
  constexpr float kMostDecay = 2;
  const V a = hn::Max(hn::Mul(half_duration, hn::Load(d, lanes.contact_re.data() + lane)),
                      hn::Set(d, -kMostDecay));
  // The bound keeps 0/0 out of lanes that hold no mode.
  const V y = hn::Max(hn::Mul(half_duration, hn::Load(d, lanes.contact_im.data() + lane)),
                      hn::Set(d, 1e-15F));
  V factor_re, factor_im;
  const auto near = hn::And(hn::Le(y, hn::Set(d, 9.5F)), hn::Ge(a, hn::Set(d, -0.25F)));
  if (HWY_LIKELY(hn::AllTrue(d, near))) {
    NearCosineFactor(a, y, factor_re, factor_im);
  } else {
    CosineFactor(a, y, factor_re, factor_im);
  }
  Multiply(factor_re, factor_im, re, im);
}

}  // namespace carillon::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // CARILLON_SERVER_SYNTHESIS_PULSE_FACTOR_INL_H_
