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

HWY_BEFORE_NAMESPACE();
namespace carillon::bank_kernel {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using Floats = hn::CappedTag<float, kMostLanes>;
using Doubles = hn::Repartition<double, Floats>;
using HalfFloats = hn::Half<Floats>;
using V = hn::Vec<Floats>;

// -140 dB of full scale, squared.
constexpr double kSilenceSquared = 1e-14;
// Far above any sound, far below what a float's square can hold.
constexpr float kMostSquared = 1e30F;

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

  /// Multiplies the state of vector v by q^(k+1).
  HWY_INLINE void Step(size_t v, size_t k) {
    const V next = hn::NegMulAdd(im[v], q_im[v][k], hn::Mul(re[v], q_re[v][k]));
    im[v] = hn::MulAdd(im[v], q_re[v][k], hn::Mul(re[v], q_im[v][k]));
    re[v] = next;
  }

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

void Ring(const LaneArrays& lanes, size_t lane_count, size_t frame_count, float* mix) {
  const float *re = lanes.start_re.data(), *im = lanes.start_im.data();
  const size_t pass = kVectorsAPass * hn::Lanes(Floats());
  size_t lane = 0;
  for (; lane + pass <= lane_count; lane += pass) {
    Vectors<kVectorsAPass> vectors;
    vectors.Load(lanes, lane, re, im);
    vectors.Add(frame_count, mix);
  }
  for (; lane < lane_count; lane += hn::Lanes(Floats())) {
    Vectors<1> vectors;
    vectors.Load(lanes, lane, re, im);
    vectors.Add(frame_count, mix);
  }
}

void RingNewborn(LaneArrays& lanes, size_t lane_count, size_t frame_count, float* mix) {
  float *re = lanes.newborn_re.data(), *im = lanes.newborn_im.data();
  for (size_t lane = 0; lane < lane_count; lane += hn::Lanes(Floats())) {
    Vectors<1> vectors;
    vectors.Load(lanes, lane, re, im);
    vectors.Add(frame_count, mix);
    vectors.Store(lane, re, im);
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

Advanced Advance(LaneArrays& lanes, size_t lane_count, bool newborn) {
  const Doubles d;
  Advanced advanced;
  for (size_t group = 0; group < lane_count; group += kMostLanes) {
    auto all_small = hn::Set(d, 1.0);
    auto loudest = hn::Zero(d);
    for (size_t i = 0; i < kMostLanes; i += hn::Lanes(d)) {
      const auto squared = AdvanceVector(lanes, group + i, newborn);
      loudest = hn::Max(loudest, squared);
      const auto small = hn::Le(squared, hn::Set(d, double{kMostSquared}));
      all_small = hn::IfThenElseZero(small, all_small);
    }
    advanced.finite &= hn::AllTrue(d, hn::Gt(all_small, hn::Zero(d)));
    if (hn::AllFalse(d, hn::Gt(loudest, hn::Set(d, kSilenceSquared)))) {
      lanes.Silence(group, kMostLanes);
    } else {
      advanced.awake_lane_count = group + kMostLanes;
    }
  }
  return advanced;
}

/// modal_impulse[c] = sum over rows of factor * row[c]: g_m of the header, but for the scale.
void Project(const Projection& projection, float* HWY_RESTRICT modal_impulse) {
  const Floats d;
  const size_t count = projection.column_count;
  size_t c = 0;
  for (; c + hn::Lanes(d) <= count; c += hn::Lanes(d)) {
    V sum = hn::Zero(d);
    for (size_t row = 0; row < projection.rows.size(); ++row) {
      sum = hn::MulAdd(hn::Set(d, projection.factors[row]), hn::LoadU(d, projection.rows[row] + c),
                       sum);
    }
    hn::Store(sum, d, modal_impulse + c);
  }
  for (; c < count; ++c) {
    modal_impulse[c] = 0;
    for (size_t row = 0; row < projection.rows.size(); ++row) {
      modal_impulse[c] += projection.factors[row] * projection.rows[row][c];
    }
  }
}

/// (re, im) *= exp(lead_frames log q + tau^2 s^2/2).
HWY_INLINE void Delay(const LaneArrays& lanes, size_t lane, V lead, V tau_squared, V& re, V& im) {
  const Floats d;
  const V logarithm = hn::MulAdd(lead, hn::Load(d, lanes.lead_re.data() + lane),
                                 hn::Mul(tau_squared, hn::Load(d, lanes.tau_re.data() + lane)));
  const V angle = hn::MulAdd(lead, hn::Load(d, lanes.lead_im.data() + lane),
                             hn::Mul(tau_squared, hn::Load(d, lanes.tau_im.data() + lane)));
  // Below exp(-80) nothing is heard, and the angle may be too large for a sine.
  const auto heard = hn::Gt(logarithm, hn::Set(d, -80.0F));
  const V magnitude = hn::IfThenElseZero(heard, hn::Exp(d, logarithm));
  const V heard_angle = hn::IfThenElseZero(heard, angle);
  const V factor_re = hn::Mul(magnitude, hn::Cos(d, heard_angle));
  const V factor_im = hn::Mul(magnitude, hn::Sin(d, heard_angle));
  const V rotated = hn::NegMulAdd(im, factor_im, hn::Mul(re, factor_re));
  im = hn::MulAdd(im, factor_re, hn::Mul(re, factor_im));
  re = rotated;
}

/// What the modal impulses add to the states, into added_re and added_im; false: not finite.
bool Add(const Projection& projection, LaneArrays& lanes, size_t lane_count) {
  const Floats d;
  const hn::RebindToSigned<Floats> di;
  const bool delayed = projection.lead_frames > 0 || projection.tau_s > 0;
  const V lead = hn::Set(d, projection.lead_frames);
  const V tau_squared = hn::Set(d, projection.tau_s * projection.tau_s);
  bool finite = true;
  for (size_t lane = 0; lane < lane_count; lane += hn::Lanes(d)) {
    const auto column =
        hn::BitCast(di, hn::Load(hn::RebindToUnsigned<Floats>(), lanes.column.data() + lane));
    const V g = hn::GatherIndex(d, lanes.modal_impulse.data(), column);
    V re = hn::Mul(g, hn::Load(d, lanes.gain_re.data() + lane));
    V im = hn::Mul(g, hn::Load(d, lanes.gain_im.data() + lane));
    if (delayed) Delay(lanes, lane, lead, tau_squared, re, im);
    hn::Store(re, d, lanes.added_re.data() + lane);
    hn::Store(im, d, lanes.added_im.data() + lane);
    const V squared = hn::MulAdd(re, re, hn::Mul(im, im));
    finite &= hn::AllTrue(d, hn::Le(squared, hn::Set(d, kMostSquared)));
  }
  return finite;
}

void AddTo(float* HWY_RESTRICT sum, const float* HWY_RESTRICT added, size_t lane_count) {
  const Floats d;
  for (size_t lane = 0; lane < lane_count; lane += hn::Lanes(d)) {
    hn::Store(hn::Add(hn::Load(d, sum + lane), hn::Load(d, added + lane)), d, sum + lane);
  }
}

bool Excite(const Projection& projection, LaneArrays& lanes, size_t lane_count) {
  Project(projection, lanes.modal_impulse.data());
  if (!Add(projection, lanes, lane_count)) return false;
  AddTo(lanes.newborn_re.data(), lanes.added_re.data(), lane_count);
  AddTo(lanes.newborn_im.data(), lanes.added_im.data(), lane_count);
  return true;
}

const char* Target() { return hwy::TargetName(HWY_TARGET); }

}  // namespace HWY_NAMESPACE
}  // namespace carillon::bank_kernel
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace carillon::bank_kernel {
HWY_EXPORT(Ring);
HWY_EXPORT(RingNewborn);
HWY_EXPORT(Advance);
HWY_EXPORT(Excite);
HWY_EXPORT(Target);

void Ring(const LaneArrays& lanes, size_t lane_count, size_t frame_count, float* mix) noexcept {
  HWY_DYNAMIC_DISPATCH(Ring)(lanes, lane_count, frame_count, mix);
}

void RingNewborn(LaneArrays& lanes, size_t lane_count, size_t frame_count, float* mix) noexcept {
  HWY_DYNAMIC_DISPATCH(RingNewborn)(lanes, lane_count, frame_count, mix);
}

Advanced Advance(LaneArrays& lanes, size_t lane_count, bool newborn) noexcept {
  return HWY_DYNAMIC_DISPATCH(Advance)(lanes, lane_count, newborn);
}

bool Excite(const Projection& projection, LaneArrays& lanes, size_t lane_count) noexcept {
  return HWY_DYNAMIC_DISPATCH(Excite)(projection, lanes, lane_count);
}

std::string_view Target() { return HWY_DYNAMIC_DISPATCH(Target)(); }

}  // namespace carillon::bank_kernel
#endif
