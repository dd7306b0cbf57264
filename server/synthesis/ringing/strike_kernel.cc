// SPDX-License-Identifier: Apache-2.0
#include "server/synthesis/ringing/strike_kernel.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "server/synthesis/ringing/strike_kernel.cc"
// foreach_target.h includes this file once for each target, and must come first.
// clang-format off
#include <hwy/foreach_target.h>
#include <hwy/highway.h>
#include <hwy/contrib/math/math-inl.h>
#include "server/synthesis/ringing/lane_vectors-inl.h"
#include "server/synthesis/ringing/pulse_factor-inl.h"
// clang-format on

#include <algorithm>

HWY_BEFORE_NAMESPACE();
namespace carillon::strike_kernel {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;
using carillon::HWY_NAMESPACE::Doubles;
using carillon::HWY_NAMESPACE::Floats;
using carillon::HWY_NAMESPACE::HalfFloats;
using carillon::HWY_NAMESPACE::kMostSquared;
using carillon::HWY_NAMESPACE::Multiply;
using carillon::HWY_NAMESPACE::SineCosine;
using carillon::HWY_NAMESPACE::SpreadOverCosine;
using carillon::HWY_NAMESPACE::V;

template <size_t kRows>
HWY_INLINE void ProjectRows(const Projection& projection, float* HWY_RESTRICT modal_impulses) {
  const Floats d;
  const hn::RebindToSigned<Floats> d32;
  const hn::Rebind<int16_t, Floats> d16;
  const int16_t* rows[kRows];
  V factors[kRows];
#pragma GCC unroll 9
  for (size_t row = 0; row < kRows; ++row) {
    rows[row] = projection.rows[row];
    factors[row] = hn::Set(d, projection.factors[row]);
  }
  const bool add = projection.add;
  const size_t count = projection.column_count;
  for (size_t c = 0; c < count; c += hn::Lanes(d)) {
    V sum = add ? hn::Load(d, modal_impulses + c) : hn::Zero(d);
#pragma GCC unroll 9
    for (size_t row = 0; row < kRows; ++row) {
      const auto values = hn::PromoteTo(d32, hn::LoadU(d16, rows[row] + c));
      sum = hn::MulAdd(factors[row], hn::ConvertTo(d, values), sum);
    }
    hn::Store(sum, d, modal_impulses + c);
  }
}

/// `row_count` is that of one, two or three vertices.
void Project(const Projection& projection, float* modal_impulses) {
  switch (projection.row_count) {
    case 9:
      return ProjectRows<9>(projection, modal_impulses);
    case 6:
      return ProjectRows<6>(projection, modal_impulses);
    default:
      return ProjectRows<3>(projection, modal_impulses);
  }
}

/// Sine and cosine of 2^kDoublings times `angle`, which is at most a quarter of a cycle.
template <int kDoublings>
HWY_INLINE void SineCosineOfMultiple(V angle, V& sine, V& cosine) {
  const Floats d;
  const V x = hn::Mul(angle, angle);
  V s = hn::MulAdd(x, hn::Set(d, 2.6000559500971576e-06F), hn::Set(d, -1.980661618290469e-04F));
  s = hn::MulAdd(s, x, hn::Set(d, 8.333017118275166e-03F));
  s = hn::MulAdd(s, x, hn::Set(d, -1.6666656732559204e-01F));
  s = hn::MulAdd(hn::Mul(s, x), angle, angle);
  V c = hn::MulAdd(x, hn::Set(d, 2.319440864084754e-05F), hn::Set(d, -1.3855928555130959e-03F));
  c = hn::MulAdd(c, x, hn::Set(d, 4.1663989424705505e-02F));
  c = hn::MulAdd(c, x, hn::Set(d, -4.999993145465851e-01F));
  c = hn::MulAdd(c, x, hn::Set(d, 1.0F));
  for (int i = 0; i < kDoublings; ++i) {
    const V twice = hn::Add(s, s);
    const V doubled = hn::Mul(twice, c);
    c = hn::NegMulAdd(twice, s, hn::Set(d, 1.0F));
    s = doubled;
  }
  sine = s;
  cosine = c;
}

/// exp(x); small x, such as a mode's decay within a frame or a tile, by its series.
HWY_INLINE V ExpOfDecay(V x) {
  const Floats d;
  const V one = hn::Set(d, 1.0F);
  const V size = hn::Abs(x);
  V e = hn::Set(d, 1.0F / 24);
  if (HWY_UNLIKELY(!hn::AllTrue(d, hn::Le(size, hn::Set(d, 0.05F))))) {
    if (!hn::AllTrue(d, hn::Le(size, hn::Set(d, 0.5F)))) return hn::Exp(d, x);
    V more = hn::MulAdd(x, hn::Set(d, 1.0F / 5040), hn::Set(d, 1.0F / 720));
    more = hn::MulAdd(more, x, hn::Set(d, 1.0F / 120));
    e = hn::MulAdd(more, x, e);
  }
  e = hn::MulAdd(e, x, hn::Set(d, 1.0F / 6));
  e = hn::MulAdd(e, x, hn::Set(d, 0.5F));
  e = hn::MulAdd(e, x, one);
  return hn::MulAdd(e, x, one);
}

/// The ways from an impulse to the frame at which states are computed.
enum class Reach {
  kAtOnce,    ///< the impulse lies on the frame
  kLead,      ///< it lies less than a frame before
  kTile,      ///< it lies at most a tile before or after
  kAnywhere,  ///< it lies anywhere, and may be a Gaussian
};

/// The distance from an impulse to the frame at which states are computed.
struct Way {
  V lead_frames;                ///< negative: that frame lies before the impulse
  V tau_squared;                ///< of a Gaussian; zero: another pulse
  V half_duration;              ///< of a raised cosine
  size_t share_ahead;           ///< values of each row ahead to prefetch for each vector
  const float* octave_factors;  ///< null: all are one
};

/// (re, im) *= exp(lead_frames log q + tau^2 s^2/2).
template <Reach kReach>
HWY_INLINE void Delay(const LaneArrays& lanes, size_t lane, const Way& way, V& re, V& im) {
  const Floats d;
  V logarithm = hn::Mul(way.lead_frames, hn::Load(d, lanes.lead_re.data() + lane));
  V angle = hn::Load(d, lanes.lead_im.data() + lane);
  V magnitude, sine, cosine;
  if constexpr (kReach == Reach::kAnywhere) {
    const V sigma = hn::Load(d, lanes.contact_re.data() + lane);
    const V omega = hn::Load(d, lanes.contact_im.data() + lane);
    const V half_square =
        hn::Mul(hn::Mul(hn::Sub(sigma, omega), hn::Add(sigma, omega)), hn::Set(d, 0.5F));
    logarithm = hn::MulAdd(way.tau_squared, half_square, logarithm);
    angle = hn::MulAdd(way.tau_squared, hn::Mul(sigma, omega), hn::Mul(way.lead_frames, angle));
    // Factors below exp(-80) are inaudible, and their angle may be too large for SineCosine.
    const auto heard = hn::Gt(logarithm, hn::Set(d, -80.0F));
    magnitude = hn::IfThenElseZero(heard, hn::Exp(d, logarithm));
    SineCosine(hn::IfThenElseZero(heard, angle), sine, cosine);
  } else {
    // A mode makes at most half a cycle in a frame, and less than a cycle in a tile.
    constexpr int kDoublings = kReach == Reach::kTile ? 2 : 1;
    magnitude = ExpOfDecay(logarithm);
    const V part = hn::Mul(way.lead_frames, hn::Set(d, 1.0F / (1 << kDoublings)));
    SineCosineOfMultiple<kDoublings>(hn::Mul(part, angle), sine, cosine);
  }
  Multiply(hn::Mul(magnitude, cosine), hn::Mul(magnitude, sine), re, im);
}

/// Prefetches `count` values, from `first` on, of all rows ahead.
HWY_INLINE void PrefetchRows(const StrikeBatch::RowsAhead& ahead, size_t first, size_t count) {
  constexpr size_t kLineValues = 32;
  const size_t end = std::min(first + count, ahead.value_count);
  for (size_t i = (first + kLineValues - 1) / kLineValues * kLineValues; i < end;
       i += kLineValues) {
    for (size_t row = 0; row < ahead.count; ++row) __builtin_prefetch(ahead.rows[row] + i);
  }
}

/// A sum of squares; Finite() is false if a term was NaN or too large.
class SumOfSquares {
 public:
  HWY_INLINE SumOfSquares() : sum_(hn::Zero(Floats())) {}
  HWY_INLINE void Add(V re, V im) { sum_ = hn::MulAdd(re, re, hn::MulAdd(im, im, sum_)); }
  HWY_INLINE bool Finite() const {
    return hn::GetLane(hn::SumOfLanes(Floats(), sum_)) <= kMostSquared;
  }

 private:
  V sum_;
};

template <Reach kReach, bool kCosine>
void ExciteLanes(const LaneArrays& lanes, LaneRange range, const float* modal_impulses,
                 const Way& way, const StrikeBatch::RowsAhead& ahead, SumOfSquares& sum,
                 float* HWY_RESTRICT added_re, float* HWY_RESTRICT added_im) {
  const Floats d;
  const hn::RebindToSigned<Floats> di;
  for (size_t lane = range.first; lane < range.first + range.count; lane += hn::Lanes(d)) {
    PrefetchRows(ahead, lane / hn::Lanes(d) * way.share_ahead, way.share_ahead);
    const auto column =
        hn::BitCast(di, hn::Load(hn::RebindToUnsigned<Floats>(), lanes.column.data() + lane));
    V g = hn::GatherIndex(d, modal_impulses, column);
    if (HWY_UNLIKELY(way.octave_factors != nullptr)) {
      const auto octave =
          hn::BitCast(di, hn::Load(hn::RebindToUnsigned<Floats>(), lanes.octave.data() + lane));
      g = hn::Mul(g, hn::GatherIndex(d, way.octave_factors, octave));
    }
    V re = hn::Mul(g, hn::Load(d, lanes.gain_re.data() + lane));
    V im = hn::Mul(g, hn::Load(d, lanes.gain_im.data() + lane));
    if constexpr (kCosine) SpreadOverCosine(lanes, lane, way.half_duration, re, im);
    if constexpr (kReach != Reach::kAtOnce) Delay<kReach>(lanes, lane, way, re, im);
    hn::Store(re, d, added_re + lane);
    hn::Store(im, d, added_im + lane);
    sum.Add(re, im);
  }
}

template <bool kCosine>
auto ChooseExcite(bool anywhere, size_t back, float lead_frames) {
  return anywhere          ? ExciteLanes<Reach::kAnywhere, kCosine>
         : back > 0        ? ExciteLanes<Reach::kTile, kCosine>
         : lead_frames > 0 ? ExciteLanes<Reach::kLead, kCosine>
                           : ExciteLanes<Reach::kAtOnce, kCosine>;
}

bool Excite(const LaneArrays& lanes, size_t lane_count, const float* modal_impulses,
            const Onset& onset, const StrikeBatch::RowsAhead& ahead, float* added_re,
            float* added_im) {
  const Floats d;
  const float tau_s = onset.gaussian_tau_s, duration_s = onset.cosine_duration_s;
  const bool anywhere = tau_s > 0 || onset.lead_frames > 1;
  const size_t share = ahead.value_count * hn::Lanes(d) / std::max<size_t>(lane_count, 1) + 1;
  SumOfSquares sum;
  for (const size_t tile_kind : kTileOrder) {
    const size_t back = tile_kind == 0 ? 0 : onset.frames_into_tiles % kTileFrames[tile_kind];
    const float lead_frames = onset.lead_frames - static_cast<float>(back);
    const Way way{hn::Set(d, lead_frames), hn::Set(d, tau_s * tau_s), hn::Set(d, duration_s / 2),
                  share, onset.octave_factors};
    const auto excite = duration_s > 0 ? ChooseExcite<true>(anywhere, back, lead_frames)
                                       : ChooseExcite<false>(anywhere, back, lead_frames);
    excite(lanes, lanes.by_tile[tile_kind], modal_impulses, way, ahead, sum, added_re, added_im);
  }
  return sum.Finite();
}

}  // namespace HWY_NAMESPACE
}  // namespace carillon::strike_kernel
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace carillon::strike_kernel {
HWY_EXPORT(Project);
HWY_EXPORT(Excite);

void Project(const Projection& projection, float* modal_impulses) noexcept {
  HWY_DYNAMIC_DISPATCH(Project)(projection, modal_impulses);
}

bool Excite(const LaneArrays& lanes, size_t lane_count, const float* modal_impulses,
            const Onset& onset, const StrikeBatch::RowsAhead& ahead, float* added_re,
            float* added_im) noexcept {
  return HWY_DYNAMIC_DISPATCH(Excite)(lanes, lane_count, modal_impulses, onset, ahead, added_re,
                                      added_im);
}

}  // namespace carillon::strike_kernel
#endif
