// SPDX-License-Identifier: Apache-2.0
#include "server/synthesis/spectrum/spectral_kernel.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "server/synthesis/spectrum/spectral_kernel.cc"
// foreach_target.h includes this file once for each target, and must come first.
// clang-format off
#include <hwy/foreach_target.h>
#include <hwy/highway.h>
#include "server/synthesis/ringing/lane_vectors-inl.h"
// clang-format on

#include <algorithm>

HWY_BEFORE_NAMESPACE();
namespace carillon::spectral_kernel {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;
using carillon::HWY_NAMESPACE::Doubles;
using carillon::HWY_NAMESPACE::Floats;
using carillon::HWY_NAMESPACE::HalfFloats;
using carillon::HWY_NAMESPACE::kMostSquared;
using carillon::HWY_NAMESPACE::Loudness;
using carillon::HWY_NAMESPACE::V;

// The number of groups by which the prefetching of lanes runs ahead.
constexpr size_t kGroupsAhead = 2;

/// The state of a group of spectral lanes in single precision.
struct GroupStart {
  alignas(64) float re[kMostLanes], im[kMostLanes];
};

HWY_INLINE Loudness StartGroup(const SpectralLanes& lanes, size_t group, GroupStart& start) {
  const Doubles d;
  const HalfFloats df;
  Loudness state;
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

/// slot += (re + i im) * weights; each pair of lanes holds a complex number.
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

/// Prefetches a group's data, because the data of a large scene do not fit into the caches.
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

Spreading Spread(SpectralLanes& lanes, size_t mode_count, double silence_squared, float* slots) {
  Spreading found;
  Loudness all;
  all.Clear();
  for (size_t group = 0; group < mode_count; group += kMostLanes) {
    uint8_t& awake = lanes.awake[group / kMostLanes];
    if (awake == 0) continue;
    PrefetchGroup(lanes, group + kGroupsAhead * kMostLanes);
    GroupStart start;
    const Loudness state = StartGroup(lanes, group, start);
    all.Join(state);
    if (!state.Above(silence_squared)) {
      std::fill_n(lanes.re.data() + group, kMostLanes, 0.0);
      std::fill_n(lanes.im.data() + group, kMostLanes, 0.0);
      awake = 0;
      found.fell_asleep = true;
      continue;
    }
    found.awake = true;
    AdvanceGroup(lanes, group);
    if (!state.Finite()) continue;
    const size_t count = std::min(kMostLanes, mode_count - group);
    for (size_t i = 0; i < count; ++i) {
      const size_t lane = group + i;
      SpreadMode(lanes.weights.data() + lane * 2 * kSpreadBins, start.re[i], start.im[i],
                 slots + size_t{lanes.slot.data()[lane]} * 2 * kSpreadBins);
    }
  }
  found.loudest_squared = all.Loudest();
  found.finite = all.Finite();
  return found;
}

}  // namespace HWY_NAMESPACE
}  // namespace carillon::spectral_kernel
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace carillon::spectral_kernel {
HWY_EXPORT(Spread);

Spreading Spread(SpectralLanes& lanes, size_t mode_count, double silence_squared,
                 float* slots) noexcept {
  return HWY_DYNAMIC_DISPATCH(Spread)(lanes, mode_count, silence_squared, slots);
}

}  // namespace carillon::spectral_kernel
#endif
