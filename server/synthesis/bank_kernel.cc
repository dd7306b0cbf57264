// SPDX-License-Identifier: Apache-2.0
#include "server/synthesis/bank_kernel.h"

// Vectors of unknown size cannot be kept in arrays, and kMostLanes bounds them.
#define HWY_DISABLED_TARGETS (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128 | HWY_RVV)
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "server/synthesis/bank_kernel.cc"
// foreach_target.h includes this file once for each target, and must come first.
// clang-format off
#include <hwy/foreach_target.h>
#include <hwy/highway.h>
#include <hwy/contrib/math/math-inl.h>
// clang-format on

#include <algorithm>

HWY_BEFORE_NAMESPACE();
namespace carillon::bank_kernel {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using Floats = hn::CappedTag<float, kMostLanes>;
using Doubles = hn::Repartition<double, Floats>;
using HalfFloats = hn::Half<Floats>;
using V = hn::Vec<Floats>;

// Far above any sound, far below what a float's square can hold.
constexpr float kMostSquared = 1e30F;

// How far ahead the lanes of long blocks are asked for.
constexpr size_t kGroupsAhead = 2;

// Vectors rendered together: enough to hide the latency of the state's recurrence, few enough to
// keep states in registers.
constexpr size_t kVectorsAPass = 2;

/// Coefficients and state of some vectors of lanes, held in registers as far as they go.
template <size_t kVectors>
struct Vectors {
  V q_re[kVectors][kTileFrames], q_im[kVectors][kTileFrames];
  V re[kVectors], im[kVectors];

  HWY_INLINE void Load(const LaneArrays& lanes, size_t lane, const float* from_re,
                       const float* from_im) {
    const Floats d;
#pragma GCC unroll 8
    for (size_t v = 0; v < kVectors; ++v, lane += hn::Lanes(d)) {
#pragma GCC unroll 8
      for (size_t k = 0; k < kTileFrames; ++k) {
        const float* power = lanes.powers.data() + LaneArrays::PowerIndex(lane, k);
        q_re[v][k] = hn::Load(d, power);
        q_im[v][k] = hn::Load(d, power + kMostLanes);
      }
      re[v] = hn::Load(d, from_re + lane);
      im[v] = hn::Load(d, from_im + lane);
    }
  }

  HWY_INLINE void Store(size_t lane, float* to_re, float* to_im) const {
    const Floats d;
#pragma GCC unroll 8
    for (size_t v = 0; v < kVectors; ++v, lane += hn::Lanes(d)) {
      hn::Store(re[v], d, to_re + lane);
      hn::Store(im[v], d, to_im + lane);
    }
  }

  /// Multiplies a state of vector v by q^(k+1).
  HWY_INLINE void Multiply(size_t v, size_t k, V& of_re, V& of_im) const {
    const V next = hn::NegMulAdd(of_im, q_im[v][k], hn::Mul(of_re, q_re[v][k]));
    of_im = hn::MulAdd(of_im, q_re[v][k], hn::Mul(of_re, q_im[v][k]));
    of_re = next;
  }

  HWY_INLINE void Step(size_t v, size_t k) { Multiply(v, k, re[v], im[v]); }

  /// Renders one tile: each sample straight from the state, then one step for all of them.
  HWY_INLINE void AddTile(float* HWY_RESTRICT mix) {
    const Floats d;
    V sum[kTileFrames];
#pragma GCC unroll 8
    for (size_t k = 0; k < kTileFrames; ++k) sum[k] = hn::Load(d, mix + k * kMostLanes);
#pragma GCC unroll 8
    for (size_t v = 0; v < kVectors; ++v) {
      sum[0] = hn::Add(sum[0], re[v]);
#pragma GCC unroll 8
      for (size_t k = 1; k < kTileFrames; ++k) {
        sum[k] = hn::MulAdd(re[v], q_re[v][k - 1], sum[k]);
        sum[k] = hn::NegMulAdd(im[v], q_im[v][k - 1], sum[k]);
      }
      Step(v, kTileFrames - 1);
    }
#pragma GCC unroll 8
    for (size_t k = 0; k < kTileFrames; ++k) hn::Store(sum[k], d, mix + k * kMostLanes);
  }

  HWY_INLINE void AddFrame(float* HWY_RESTRICT mix) {
    const Floats d;
    V sum = hn::Load(d, mix);
#pragma GCC unroll 8
    for (size_t v = 0; v < kVectors; ++v) {
      sum = hn::Add(sum, re[v]);
      Step(v, 0);
    }
    hn::Store(sum, d, mix);
  }

  HWY_INLINE void Add(size_t frame_count, float* mix) {
    size_t n = 0;
    for (; n + kTileFrames <= frame_count; n += kTileFrames) AddTile(mix + n * kMostLanes);
    for (; n < frame_count; ++n) AddFrame(mix + n * kMostLanes);
  }
};

/// Asks for what rendering a group of lanes, and advancing them thereafter, will need.
HWY_INLINE void PrefetchLanes(const LaneArrays& lanes, size_t lane) {
  constexpr size_t kLine = 64;
  const auto prefetch = [](const auto* first, size_t count) {
    for (size_t i = 0; i < count; i += kLine / sizeof(*first)) __builtin_prefetch(first + i);
  };
  const size_t group = lane / kMostLanes * kMostLanes;
  prefetch(lanes.powers.data() + LaneArrays::PowerIndex(group, 0), kMostLanes * 2 * kTileFrames);
  for (const LaneArray<float>* state :
       {&lanes.start_re, &lanes.start_im, &lanes.newborn_re, &lanes.newborn_im}) {
    prefetch(state->data() + group, kMostLanes);
  }
  for (const LaneArray<double>* state : {&lanes.re, &lanes.im, &lanes.block_re, &lanes.block_im}) {
    prefetch(state->data() + group, kMostLanes);
  }
}

void Ring(const LaneArrays& lanes, LaneRange range, size_t frame_count, float* mix) {
  const float *re = lanes.start_re.data(), *im = lanes.start_im.data();
  const size_t pass = kVectorsAPass * hn::Lanes(Floats());
  const size_t end = range.first + range.count;
  size_t lane = range.first;
  for (; lane + pass <= end; lane += pass) {
    for (size_t i = 0; i < pass; i += kMostLanes) PrefetchLanes(lanes, lane + pass + i);
    Vectors<kVectorsAPass> vectors;
    vectors.Load(lanes, lane, re, im);
    vectors.Add(frame_count, mix);
  }
  for (; lane < end; lane += hn::Lanes(Floats())) {
    Vectors<1> vectors;
    vectors.Load(lanes, lane, re, im);
    vectors.Add(frame_count, mix);
  }
}

/// Vectors that are struck: what rings, and of it what is newborn, which advances beside it.
template <size_t kVectors>
struct StruckVectors {
  Vectors<kVectors> all;
  V newborn_re[kVectors], newborn_im[kVectors];

  HWY_INLINE void Load(const LaneArrays& lanes, size_t lane) {
    const Floats d;
    all.Load(lanes, lane, lanes.start_re.data(), lanes.start_im.data());
#pragma GCC unroll 8
    for (size_t v = 0; v < kVectors; ++v, lane += hn::Lanes(d)) {
      newborn_re[v] = hn::Load(d, lanes.newborn_re.data() + lane);
      newborn_im[v] = hn::Load(d, lanes.newborn_im.data() + lane);
    }
  }

  HWY_INLINE void Store(LaneArrays& lanes, size_t lane) const {
    const Floats d;
    all.Store(lane, lanes.start_re.data(), lanes.start_im.data());
#pragma GCC unroll 8
    for (size_t v = 0; v < kVectors; ++v, lane += hn::Lanes(d)) {
      hn::Store(newborn_re[v], d, lanes.newborn_re.data() + lane);
      hn::Store(newborn_im[v], d, lanes.newborn_im.data() + lane);
    }
  }

  HWY_INLINE void Strike(const float* added_re, const float* added_im) {
    const Floats d;
#pragma GCC unroll 8
    for (size_t v = 0; v < kVectors; ++v) {
      const V re = hn::Load(d, added_re + v * hn::Lanes(d));
      const V im = hn::Load(d, added_im + v * hn::Lanes(d));
      all.re[v] = hn::Add(all.re[v], re);
      all.im[v] = hn::Add(all.im[v], im);
      newborn_re[v] = hn::Add(newborn_re[v], re);
      newborn_im[v] = hn::Add(newborn_im[v], im);
    }
  }

  HWY_INLINE void Step(size_t k) {
#pragma GCC unroll 8
    for (size_t v = 0; v < kVectors; ++v) all.Multiply(v, k, newborn_re[v], newborn_im[v]);
  }

  /// `bare`: nothing is newborn yet.
  HWY_INLINE void Add(size_t begin, size_t end, bool bare, float* mix) {
    size_t n = begin;
    for (; n + kTileFrames <= end; n += kTileFrames) {
      all.AddTile(mix + n * kMostLanes);
      if (!bare) Step(kTileFrames - 1);
    }
    for (; n < end; ++n) {
      all.AddFrame(mix + n * kMostLanes);
      if (!bare) Step(0);
    }
  }

  HWY_INLINE void Ring(const StruckPart& part, size_t lane, float* mix) {
    size_t frame = part.begin;
    for (size_t i = 0; i < part.batch.count; ++i) {
      Add(frame, part.batch.offsets[i], part.begin == 0 && i == 0, mix);
      frame = part.batch.offsets[i];
      Strike(part.batch.re(i, part.lane_count) + lane, part.batch.im(i, part.lane_count) + lane);
    }
    Add(frame, part.end, false, mix);
  }
};

void RingStruck(LaneArrays& lanes, LaneRange range, const StruckPart& part, float* mix) {
  const size_t pass = kVectorsAPass * hn::Lanes(Floats());
  const size_t end = range.first + range.count;
  size_t lane = range.first;
  for (; lane + pass <= end; lane += pass) {
    for (size_t i = 0; i < pass; i += kMostLanes) PrefetchLanes(lanes, lane + pass + i);
    StruckVectors<kVectorsAPass> vectors;
    vectors.Load(lanes, lane);
    vectors.Ring(part, lane, mix);
    vectors.Store(lanes, lane);
  }
  for (; lane < end; lane += hn::Lanes(Floats())) {
    StruckVectors<1> vectors;
    vectors.Load(lanes, lane);
    vectors.Ring(part, lane, mix);
    vectors.Store(lanes, lane);
  }
}

void AddStrike(LaneArrays& lanes, size_t lane_count, const float* added_re, const float* added_im) {
  for (size_t lane = 0; lane < lane_count; lane += hn::Lanes(Floats())) {
    StruckVectors<1> vectors;
    vectors.Load(lanes, lane);
    vectors.Strike(added_re + lane, added_im + lane);
    vectors.Store(lanes, lane);
  }
}

/// Advances one vector in double; returns |Z|^2.
HWY_INLINE hn::Vec<Doubles> AdvanceVector(LaneArrays& lanes, size_t lane, bool newborn) {
  const Doubles d;
  const HalfFloats df;
  const auto q_re = hn::Load(d, lanes.block_re.data() + lane);
  const auto q_im = hn::Load(d, lanes.block_im.data() + lane);
  const auto old_re = hn::Load(d, lanes.re.data() + lane);
  const auto old_im = hn::Load(d, lanes.im.data() + lane);
  auto re = hn::NegMulAdd(old_im, q_im, hn::Mul(old_re, q_re));
  auto im = hn::MulAdd(old_im, q_re, hn::Mul(old_re, q_im));
  if (newborn) {
    re = hn::Add(re, hn::PromoteTo(d, hn::Load(df, lanes.newborn_re.data() + lane)));
    im = hn::Add(im, hn::PromoteTo(d, hn::Load(df, lanes.newborn_im.data() + lane)));
    hn::Store(hn::Zero(df), df, lanes.newborn_re.data() + lane);
    hn::Store(hn::Zero(df), df, lanes.newborn_im.data() + lane);
  }
  hn::Store(re, d, lanes.re.data() + lane);
  hn::Store(im, d, lanes.im.data() + lane);
  hn::Store(hn::DemoteTo(df, re), df, lanes.start_re.data() + lane);
  hn::Store(hn::DemoteTo(df, im), df, lanes.start_im.data() + lane);
  return hn::MulAdd(re, re, hn::Mul(im, im));
}

/// What is found of a group of lanes while they advance.
struct GroupState {
  hn::Vec<Doubles> all_small, loudest;

  HWY_INLINE void Clear() {
    all_small = hn::Set(Doubles(), 1.0);
    loudest = hn::Zero(Doubles());
  }
  HWY_INLINE void Note(hn::Vec<Doubles> squared) {
    const Doubles d;
    loudest = hn::Max(loudest, squared);
    all_small = hn::IfThenElseZero(hn::Le(squared, hn::Set(d, double{kMostSquared})), all_small);
  }
  HWY_INLINE bool Finite() const {
    return hn::AllTrue(Doubles(), hn::Gt(all_small, hn::Zero(Doubles())));
  }
  HWY_INLINE double Loudest() const { return hn::GetLane(hn::MaxOfLanes(Doubles(), loudest)); }
};

Advanced Advance(LaneArrays& lanes, LaneRange range, bool newborn, double silence_squared) {
  Advanced advanced;
  for (size_t group = 0; group < range.count; group += kMostLanes) {
    GroupState state;
    state.Clear();
    for (size_t i = 0; i < kMostLanes; i += hn::Lanes(Doubles())) {
      state.Note(AdvanceVector(lanes, range.first + group + i, newborn));
    }
    advanced.finite &= state.Finite();
    const double loudest = state.Loudest();
    advanced.loudest_squared = std::max(advanced.loudest_squared, loudest);
    if (!(loudest > silence_squared)) {
      lanes.Silence({range.first + group, kMostLanes});
    } else {
      advanced.awake = true;
      advanced.awake_lane_count = group + kMostLanes;
    }
  }
  return advanced;
}

/// The state of a group of spectral lanes in single precision.
struct GroupStart {
  alignas(64) float re[kMostLanes], im[kMostLanes];
};

HWY_INLINE GroupState StartGroup(const SpectralLanes& lanes, size_t group, GroupStart& start) {
  const Doubles d;
  const HalfFloats df;
  GroupState state;
  state.Clear();
  for (size_t i = 0; i < kMostLanes; i += hn::Lanes(d)) {
    const auto re = hn::Load(d, lanes.re.data() + group + i);
    const auto im = hn::Load(d, lanes.im.data() + group + i);
    hn::Store(hn::DemoteTo(df, re), df, start.re + i);
    hn::Store(hn::DemoteTo(df, im), df, start.im + i);
    state.Note(hn::MulAdd(re, re, hn::Mul(im, im)));
  }
  return state;
}

HWY_INLINE void AdvanceGroup(SpectralLanes& lanes, size_t group) {
  const Doubles d;
  for (size_t lane = group; lane < group + kMostLanes; lane += hn::Lanes(d)) {
    const auto q_re = hn::Load(d, lanes.block_re.data() + lane);
    const auto q_im = hn::Load(d, lanes.block_im.data() + lane);
    const auto re = hn::Load(d, lanes.re.data() + lane);
    const auto im = hn::Load(d, lanes.im.data() + lane);
    hn::Store(hn::NegMulAdd(im, q_im, hn::Mul(re, q_re)), d, lanes.re.data() + lane);
    hn::Store(hn::MulAdd(im, q_re, hn::Mul(re, q_im)), d, lanes.im.data() + lane);
  }
}

/// slot += (re + i im) * weights, complex numbers lying pairwise in the lanes.
HWY_INLINE void SpreadMode(const float* HWY_RESTRICT weights, float re, float im,
                           float* HWY_RESTRICT slot) {
#if HWY_TARGET == HWY_SCALAR
  for (size_t i = 0; i < 2 * kSpreadBins; i += 2) {
    slot[i] += re * weights[i] - im * weights[i + 1];
    slot[i + 1] += re * weights[i + 1] + im * weights[i];
  }
#else
  const Floats d;
  const V z_re = hn::Set(d, re);
  const V z_im = hn::OddEven(hn::Set(d, im), hn::Set(d, -im));
#pragma GCC unroll 4
  for (size_t i = 0; i < 2 * kSpreadBins; i += hn::Lanes(d)) {
    const V w = hn::Load(d, weights + i);
    const V sum = hn::MulAdd(z_re, w, hn::Load(d, slot + i));
    hn::Store(hn::MulAdd(z_im, hn::Reverse2(d, w), sum), d, slot + i);
  }
#endif
}

/// Asks for the lines of a group that will be needed soon: the figures of a large scene come from
/// beyond the caches.
HWY_INLINE void PrefetchGroup(const SpectralLanes& lanes, size_t group) {
  constexpr size_t kLine = 64;
  const auto prefetch = [](const auto* first, size_t count) {
    for (size_t i = 0; i < count; i += kLine / sizeof(*first)) __builtin_prefetch(first + i);
  };
  prefetch(lanes.re.data() + group, kMostLanes);
  prefetch(lanes.im.data() + group, kMostLanes);
  prefetch(lanes.block_re.data() + group, kMostLanes);
  prefetch(lanes.block_im.data() + group, kMostLanes);
  prefetch(lanes.slot.data() + group, kMostLanes);
  prefetch(lanes.weights.data() + group * 2 * kSpreadBins, kMostLanes * 2 * kSpreadBins);
}

Advanced Spread(SpectralLanes& lanes, size_t mode_count, double silence_squared, float* slots) {
  Advanced advanced;
  for (size_t group = 0; group < mode_count; group += kMostLanes) {
    uint8_t& awake = lanes.awake[group / kMostLanes];
    if (awake == 0) continue;
    PrefetchGroup(lanes, group + kGroupsAhead * kMostLanes);
    GroupStart start;
    const GroupState state = StartGroup(lanes, group, start);
    advanced.finite &= state.Finite();
    const double loudest = state.Loudest();
    advanced.loudest_squared = std::max(advanced.loudest_squared, loudest);
    if (!(loudest > silence_squared)) {
      std::fill_n(lanes.re.data() + group, kMostLanes, 0.0);
      std::fill_n(lanes.im.data() + group, kMostLanes, 0.0);
      awake = 0;
      advanced.fell_asleep = true;
      continue;
    }
    advanced.awake = true;
    AdvanceGroup(lanes, group);
    if (!state.Finite()) continue;
    const size_t count = std::min(kMostLanes, mode_count - group);
    for (size_t i = 0; i < count; ++i) {
      const size_t lane = group + i;
      SpreadMode(lanes.weights.data() + lane * 2 * kSpreadBins, start.re[i], start.im[i],
                 slots + size_t{lanes.slot.data()[lane]} * 2 * kSpreadBins);
    }
  }
  return advanced;
}

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

/// Sine and cosine at once, to 1e-7 for |angle| up to some thousands: reduced to a quarter turn in
/// three parts (Cody and Waite), then the series of each, telescoped.
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

/// (re, im) *= exp(lead_frames log q + tau^2 s^2/2).
HWY_INLINE void Delay(const LaneArrays& lanes, size_t lane, V lead, V tau_squared, bool soft, V& re,
                      V& im) {
  const Floats d;
  V logarithm = hn::Mul(lead, hn::Load(d, lanes.lead_re.data() + lane));
  V angle = hn::Mul(lead, hn::Load(d, lanes.lead_im.data() + lane));
  if (soft) {
    logarithm = hn::MulAdd(tau_squared, hn::Load(d, lanes.tau_re.data() + lane), logarithm);
    angle = hn::MulAdd(tau_squared, hn::Load(d, lanes.tau_im.data() + lane), angle);
  }
  // Below exp(-80) nothing is heard, and the angle may be too large for a sine.
  const auto heard = hn::Gt(logarithm, hn::Set(d, -80.0F));
  const V magnitude = hn::IfThenElseZero(heard, hn::Exp(d, logarithm));
  const V heard_angle = hn::IfThenElseZero(heard, angle);
  V sine, cosine;
  SineCosine(heard_angle, sine, cosine);
  const V factor_re = hn::Mul(magnitude, cosine);
  const V factor_im = hn::Mul(magnitude, sine);
  const V rotated = hn::NegMulAdd(im, factor_im, hn::Mul(re, factor_re));
  im = hn::MulAdd(im, factor_re, hn::Mul(re, factor_im));
  re = rotated;
}

HWY_INLINE void PrefetchRows(const StrikeBatch::RowsAhead& ahead, size_t first, size_t count) {
  constexpr size_t kLineValues = 32;
  const size_t end = std::min(first + count, ahead.value_count);
  for (size_t i = (first + kLineValues - 1) / kLineValues * kLineValues; i < end;
       i += kLineValues) {
    for (size_t row = 0; row < ahead.count; ++row) __builtin_prefetch(ahead.rows[row] + i);
  }
}

bool Excite(const LaneArrays& lanes, size_t lane_count, const float* modal_impulses,
            const Onset& onset, const StrikeBatch::RowsAhead& ahead, float* added_re,
            float* added_im) {
  const Floats d;
  const hn::RebindToSigned<Floats> di;
  const bool delayed = onset.lead_frames > 0 || onset.tau_s > 0;
  const V lead = hn::Set(d, onset.lead_frames);
  const V tau_squared = hn::Set(d, onset.tau_s * onset.tau_s);
  bool finite = true;
  // A share of the rows ahead for each vector.
  const size_t share = ahead.value_count * hn::Lanes(d) / std::max<size_t>(lane_count, 1) + 1;
  for (size_t lane = 0; lane < lane_count; lane += hn::Lanes(d)) {
    PrefetchRows(ahead, lane / hn::Lanes(d) * share, share);
    const auto column =
        hn::BitCast(di, hn::Load(hn::RebindToUnsigned<Floats>(), lanes.column.data() + lane));
    const V g = hn::GatherIndex(d, modal_impulses, column);
    V re = hn::Mul(g, hn::Load(d, lanes.gain_re.data() + lane));
    V im = hn::Mul(g, hn::Load(d, lanes.gain_im.data() + lane));
    if (delayed) Delay(lanes, lane, lead, tau_squared, onset.tau_s > 0, re, im);
    hn::Store(re, d, added_re + lane);
    hn::Store(im, d, added_im + lane);
    const V squared = hn::MulAdd(re, re, hn::Mul(im, im));
    finite &= hn::AllTrue(d, hn::Le(squared, hn::Set(d, kMostSquared)));
  }
  return finite;
}

const char* Target() { return hwy::TargetName(HWY_TARGET); }

}  // namespace HWY_NAMESPACE
}  // namespace carillon::bank_kernel
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace carillon::bank_kernel {
HWY_EXPORT(Ring);
HWY_EXPORT(RingStruck);
HWY_EXPORT(AddStrike);
HWY_EXPORT(Advance);
HWY_EXPORT(Spread);
HWY_EXPORT(Project);
HWY_EXPORT(Excite);
HWY_EXPORT(Target);

void Ring(const LaneArrays& lanes, LaneRange range, size_t frame_count, float* mix) noexcept {
  HWY_DYNAMIC_DISPATCH(Ring)(lanes, range, frame_count, mix);
}

void RingStruck(LaneArrays& lanes, LaneRange range, const StruckPart& part, float* mix) noexcept {
  HWY_DYNAMIC_DISPATCH(RingStruck)(lanes, range, part, mix);
}

void AddStrike(LaneArrays& lanes, size_t lane_count, const float* added_re,
               const float* added_im) noexcept {
  HWY_DYNAMIC_DISPATCH(AddStrike)(lanes, lane_count, added_re, added_im);
}

Advanced Advance(LaneArrays& lanes, LaneRange range, bool newborn,
                 double silence_squared) noexcept {
  return HWY_DYNAMIC_DISPATCH(Advance)(lanes, range, newborn, silence_squared);
}

Advanced Spread(SpectralLanes& lanes, size_t mode_count, double silence_squared,
                float* slots) noexcept {
  return HWY_DYNAMIC_DISPATCH(Spread)(lanes, mode_count, silence_squared, slots);
}

void Project(const Projection& projection, float* modal_impulses) noexcept {
  HWY_DYNAMIC_DISPATCH(Project)(projection, modal_impulses);
}

bool Excite(const LaneArrays& lanes, size_t lane_count, const float* modal_impulses,
            const Onset& onset, const StrikeBatch::RowsAhead& ahead, float* added_re,
            float* added_im) noexcept {
  return HWY_DYNAMIC_DISPATCH(Excite)(lanes, lane_count, modal_impulses, onset, ahead, added_re,
                                      added_im);
}

std::string_view Target() { return HWY_DYNAMIC_DISPATCH(Target)(); }

}  // namespace carillon::bank_kernel
#endif
