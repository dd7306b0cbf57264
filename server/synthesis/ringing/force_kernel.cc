// SPDX-License-Identifier: Apache-2.0
#include "server/synthesis/ringing/force_kernel.h"

#include <algorithm>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "server/synthesis/ringing/force_kernel.cc"
// foreach_target.h includes this file once for each target, and must come first.
// clang-format off
#include <hwy/foreach_target.h>
#include <hwy/highway.h>
// clang-format on

HWY_BEFORE_NAMESPACE();
namespace carillon::force_kernel {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using Floats = hn::CappedTag<float, kMostLanes>;
using V = hn::Vec<Floats>;

// This limit is far above any change of a force's slope, and its products do not overflow.
constexpr float kMostForce = 1e15F;

void AddForce(const strike_kernel::Projection& projection, float* HWY_RESTRICT next) {
  for (size_t row = 0; row < projection.row_count; ++row) {
    const float factor = projection.factors[row];
    const int16_t* HWY_RESTRICT shape = projection.rows[row];
    for (size_t c = 0; c < projection.column_count; ++c)
      next[c] += factor * static_cast<float>(shape[c]);
  }
}

bool EndStep(float rate_hz, ForceArrays& force) {
  const size_t column_count = force.column_count;
  float *next = force.next.data(), *last = force.last.data();
  float *slope = force.slope.data(), *jump = force.jump.data();
  bool finite = true;
  for (size_t c = 0; c < column_count; ++c) {
    const float new_slope = (next[c] - last[c]) * rate_hz;
    jump[c] = new_slope - slope[c];
    slope[c] = new_slope;
    last[c] = next[c];
    next[c] = 0;
    finite &= jump[c] >= -kMostForce && jump[c] <= kMostForce;
  }
  if (!finite) force.Clear();
  return finite;
}

/// values[column of each lane].
HWY_INLINE V LoadColumns(const LaneArrays& lanes, size_t lane, const float* values) {
  const hn::RebindToSigned<Floats> signed_tag;
  const auto column = hn::Load(hn::RebindToUnsigned<Floats>(), lanes.column.data() + lane);
  return hn::GatherIndex(Floats(), values, hn::BitCast(signed_tag, column));
}

void Kink(const ForceArrays& force, const LaneArrays& lanes, float* added_re, float* added_im) {
  const Floats d;
  for (size_t lane = 0; lane < force.lane_count; lane += hn::Lanes(d)) {
    const V jump = LoadColumns(lanes, lane, force.jump.data());
    hn::Store(hn::Mul(jump, hn::Load(d, force.kink_re.data() + lane)), d, added_re + lane);
    hn::Store(hn::Mul(jump, hn::Load(d, force.kink_im.data() + lane)), d, added_im + lane);
  }
}

HWY_INLINE void SetDrivePart(V position, V drive, float* HWY_RESTRICT from,
                             float* HWY_RESTRICT to) {
  const Floats d;
  const V old_from = hn::Load(d, from);
  const V old_to = hn::Load(d, to);
  hn::Store(hn::MulAdd(position, hn::Sub(old_to, old_from), old_from), d, from);
  hn::Store(drive, d, to);
}

void SetDrive(float position, float scale, const LaneArrays& lanes, ForceArrays& force) {
  const Floats d;
  const V share = hn::Set(d, position);
  for (size_t lane = 0; lane < force.lane_count; lane += hn::Lanes(d)) {
    const V last = hn::Mul(LoadColumns(lanes, lane, force.last.data()), hn::Set(d, scale));
    SetDrivePart(share, hn::Mul(last, hn::Load(d, lanes.gain_re.data() + lane)),
                 force.from_re.data() + lane, force.to_re.data() + lane);
    SetDrivePart(share, hn::Mul(last, hn::Load(d, lanes.gain_im.data() + lane)),
                 force.from_im.data() + lane, force.to_im.data() + lane);
  }
}

/// A state of complex numbers that is driven and advanced by q.
struct DrivenState {
  V re, im;

  HWY_INLINE void Load(const float* from_re, const float* from_im) {
    re = hn::Load(Floats(), from_re);
    im = hn::Load(Floats(), from_im);
  }
  HWY_INLINE void Store(float* to_re, float* to_im) const {
    hn::Store(re, Floats(), to_re);
    hn::Store(im, Floats(), to_im);
  }
  HWY_INLINE void Grow(V by_re, V by_im) {
    re = hn::Add(re, by_re);
    im = hn::Add(im, by_im);
  }
  HWY_INLINE void Step(V q_re, V q_im) {
    const V next = hn::NegMulAdd(im, q_im, hn::Mul(re, q_re));
    im = hn::MulAdd(im, q_re, hn::Mul(re, q_im));
    re = next;
  }
};

/// Adds the real part of gain * state to a frame.
struct DrivenGain {
  V re, im;
  float* mix;

  HWY_INLINE DrivenGain(const ring_kernel::Gains& gains, float* to, size_t lane)
      : re(hn::Load(Floats(), gains.re + lane)), im(hn::Load(Floats(), gains.im + lane)), mix(to) {}
  HWY_INLINE void Add(size_t n, const DrivenState& state) const {
    const Floats d;
    float* HWY_RESTRICT frame = mix + n * kMostLanes;
    const V sum = hn::MulAdd(state.re, re, hn::Load(d, frame));
    hn::Store(hn::NegMulAdd(state.im, im, sum), d, frame);
  }
};

/// Adds the state itself to a frame.
struct NoDrivenGain {
  float* mix;

  HWY_INLINE void Add(size_t n, const DrivenState& state) const {
    const Floats d;
    float* HWY_RESTRICT frame = mix + n * kMostLanes;
    hn::Store(hn::Add(hn::Load(d, frame), state.re), d, frame);
  }
};

/// `make_outputs`(lane) has a member Add(frame, state).
template <class MakeOutputs>
HWY_INLINE void RingDrivenTo(const ForceArrays& force, const Drive& drive, LaneArrays& lanes,
                             const MakeOutputs& make_outputs) {
  const Floats d;
  for (size_t lane = 0; lane < force.lane_count; lane += hn::Lanes(d)) {
    const V q_re = hn::Load(d, lanes.q_re.data() + lane);
    const V q_im = hn::Load(d, lanes.q_im.data() + lane);
    const V from_re = hn::Load(d, force.from_re.data() + lane);
    const V from_im = hn::Load(d, force.from_im.data() + lane);
    const V to_re = hn::Load(d, force.to_re.data() + lane);
    const V to_im = hn::Load(d, force.to_im.data() + lane);
    const auto outputs = make_outputs(lane);
    DrivenState all, fresh;
    all.Load(lanes.start_re.data() + lane, lanes.start_im.data() + lane);
    fresh.Load(lanes.fresh_re.data() + lane, lanes.fresh_im.data() + lane);
    for (size_t n = 0; n < drive.frame_count; ++n) {
      const V a = hn::Set(d, drive.from_share[n]), b = hn::Set(d, drive.to_share[n]);
      const V by_re = hn::MulAdd(a, from_re, hn::Mul(b, to_re));
      const V by_im = hn::MulAdd(a, from_im, hn::Mul(b, to_im));
      all.Grow(by_re, by_im);
      fresh.Grow(by_re, by_im);
      outputs.Add(n, all);
      all.Step(q_re, q_im);
      fresh.Step(q_re, q_im);
    }
    all.Store(lanes.start_re.data() + lane, lanes.start_im.data() + lane);
    fresh.Store(lanes.fresh_re.data() + lane, lanes.fresh_im.data() + lane);
  }
}

struct BothDrivenGains {
  DrivenGain first, second;

  HWY_INLINE void Add(size_t n, const DrivenState& state) const {
    first.Add(n, state);
    second.Add(n, state);
  }
};

void RingDriven(const ForceArrays& force, const Drive& drive, LaneArrays& lanes,
                const DrivenOutput& output) {
  if (output.gains.re == nullptr) {
    RingDrivenTo(force, drive, lanes, [&](size_t) { return NoDrivenGain{output.mix}; });
  } else if (output.second_mix == nullptr) {
    RingDrivenTo(force, drive, lanes,
                 [&](size_t lane) { return DrivenGain(output.gains, output.mix, lane); });
  } else {
    RingDrivenTo(force, drive, lanes, [&](size_t lane) {
      return BothDrivenGains{DrivenGain(output.gains, output.mix, lane),
                             DrivenGain(output.second_gains, output.second_mix, lane)};
    });
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace carillon::force_kernel
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace carillon {

void ForceArrays::Clear() noexcept {
  for (LaneArray<float>* columns : {&next, &last, &slope, &jump}) {
    std::fill_n(columns->data(), column_count, 0.0F);
  }
  for (LaneArray<float>* lanes : {&from_re, &from_im, &to_re, &to_im}) {
    std::fill_n(lanes->data(), lane_count, 0.0F);
  }
}

namespace force_kernel {
HWY_EXPORT(AddForce);
HWY_EXPORT(EndStep);
HWY_EXPORT(Kink);
HWY_EXPORT(SetDrive);
HWY_EXPORT(RingDriven);

void AddForce(const strike_kernel::Projection& projection, float* next) noexcept {
  HWY_DYNAMIC_DISPATCH(AddForce)(projection, next);
}

bool EndStep(float rate_hz, ForceArrays& force) noexcept {
  return HWY_DYNAMIC_DISPATCH(EndStep)(rate_hz, force);
}

void Kink(const ForceArrays& force, const LaneArrays& lanes, float* added_re,
          float* added_im) noexcept {
  HWY_DYNAMIC_DISPATCH(Kink)(force, lanes, added_re, added_im);
}

void SetDrive(float position, float scale, const LaneArrays& lanes, ForceArrays& force) noexcept {
  HWY_DYNAMIC_DISPATCH(SetDrive)(position, scale, lanes, force);
}

void RingDriven(const ForceArrays& force, const Drive& drive, LaneArrays& lanes,
                const DrivenOutput& output) noexcept {
  HWY_DYNAMIC_DISPATCH(RingDriven)(force, drive, lanes, output);
}

}  // namespace force_kernel
}  // namespace carillon
#endif
