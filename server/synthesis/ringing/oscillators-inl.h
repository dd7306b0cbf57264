// SPDX-License-Identifier: Apache-2.0
// Oscillators in single precision, compiled for each SIMD target; see lane_vectors-inl.h.
#if defined(CARILLON_SERVER_SYNTHESIS_OSCILLATORS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef CARILLON_SERVER_SYNTHESIS_OSCILLATORS_INL_H_
#undef CARILLON_SERVER_SYNTHESIS_OSCILLATORS_INL_H_
#else
#define CARILLON_SERVER_SYNTHESIS_OSCILLATORS_INL_H_
#endif

#include <cstddef>

#include "server/synthesis/ringing/lane_arrays.h"
#include "server/synthesis/ringing/lane_vectors-inl.h"

HWY_BEFORE_NAMESPACE();
namespace carillon::HWY_NAMESPACE {

/// One complex number in each lane of kVectors vectors.
template <size_t kVectors>
struct States {
  V re[kVectors], im[kVectors];

  HWY_INLINE void Clear() {
#pragma GCC unroll 8
    for (size_t v = 0; v < kVectors; ++v) re[v] = im[v] = hn::Zero(Floats());
  }
  HWY_INLINE void Load(const float* from_re, const float* from_im) {
    const Floats d;
#pragma GCC unroll 8
    for (size_t v = 0; v < kVectors; ++v) {
      re[v] = hn::Load(d, from_re + v * hn::Lanes(d));
      im[v] = hn::Load(d, from_im + v * hn::Lanes(d));
    }
  }
  HWY_INLINE void Load(const double* from_re, const double* from_im) {
    const Floats d;
#pragma GCC unroll 8
    for (size_t v = 0; v < kVectors; ++v) {
      re[v] = Demoted(from_re + v * hn::Lanes(d));
      im[v] = Demoted(from_im + v * hn::Lanes(d));
    }
  }
  HWY_INLINE void Store(float* to_re, float* to_im) const {
    const Floats d;
#pragma GCC unroll 8
    for (size_t v = 0; v < kVectors; ++v) {
      hn::Store(re[v], d, to_re + v * hn::Lanes(d));
      hn::Store(im[v], d, to_im + v * hn::Lanes(d));
    }
  }
  HWY_INLINE void Add(const States& other) {
#pragma GCC unroll 8
    for (size_t v = 0; v < kVectors; ++v) {
      re[v] = hn::Add(re[v], other.re[v]);
      im[v] = hn::Add(im[v], other.im[v]);
    }
  }
  HWY_INLINE void Multiply(size_t v, V by_re, V by_im) {
    const V next = hn::NegMulAdd(im[v], by_im, hn::Mul(re[v], by_re));
    im[v] = hn::MulAdd(im[v], by_re, hn::Mul(re[v], by_im));
    re[v] = next;
  }
  HWY_INLINE void Multiply(const States& other) {
#pragma GCC unroll 8
    for (size_t v = 0; v < kVectors; ++v) Multiply(v, other.re[v], other.im[v]);
  }

 private:
  static HWY_INLINE V Demoted(const double* from) {
    const Doubles d;
    const HalfFloats df;
#if HWY_TARGET == HWY_SCALAR
    return hn::DemoteTo(df, hn::Load(d, from));
#else
    return hn::Combine(Floats(), hn::DemoteTo(df, hn::Load(d, from + hn::Lanes(d))),
                       hn::DemoteTo(df, hn::Load(d, from)));
#endif
  }
};

/// Powers of q for tiles of the first kind, for lanes that normally use longer tiles.
template <size_t kVectors>
struct FramePowers {
  alignas(64) float values[kVectors][2 * kTileNodes * kMostLanes];

  /// Computes the powers that `frame_count` frames need.
  HWY_INLINE void Set(const LaneArrays& lanes, size_t lane, size_t frame_count) {
    States<kVectors> q, power, step;
    q.Load(lanes.q_re.data() + lane, lanes.q_im.data() + lane);
    power = q;
    for (size_t k = 0; k < HWY_MIN(frame_count, kTileNodes - 1); ++k) {
      Store(power, k);
      power.Multiply(q);
    }
    step.Load(lanes.step_re.data() + lane, lanes.step_im.data() + lane);
    Store(step, kTileNodes - 1);
  }

 private:
  HWY_INLINE void Store(const States<kVectors>& power, size_t k) {
    for (size_t v = 0; v < kVectors; ++v) {
      hn::Store(power.re[v], Floats(), values[v] + k * 2 * kMostLanes);
      hn::Store(power.im[v], Floats(), values[v] + (k * 2 + 1) * kMostLanes);
    }
  }
};

/// The oscillators of kVectors vectors of lanes, all in tiles of one kind.
template <size_t kVectors>
struct Oscillators {
  using Z = States<kVectors>;
  static constexpr size_t kCount = kVectors;
  const float* powers[kVectors];
  const float *q_re, *q_im;
  size_t tile_kind;

  HWY_INLINE Oscillators(const LaneArrays& lanes, size_t lane, size_t kind)
      : q_re(lanes.q_re.data() + lane), q_im(lanes.q_im.data() + lane), tile_kind(kind) {
    for (size_t v = 0; v < kVectors; ++v) {
      powers[v] = lanes.powers.data() + LaneArrays::PowerIndex(lane + v * hn::Lanes(Floats()), 0);
    }
  }

  /// Switches to tiles of the first kind.
  HWY_INLINE void Use(const FramePowers<kVectors>& frame_powers) {
    for (size_t v = 0; v < kVectors; ++v) powers[v] = frame_powers.values[v];
    tile_kind = 0;
  }

  HWY_INLINE V PowerRe(size_t v, size_t k) const {
    return hn::Load(Floats(), powers[v] + k * 2 * kMostLanes);
  }
  HWY_INLINE V PowerIm(size_t v, size_t k) const {
    return hn::Load(Floats(), powers[v] + (k * 2 + 1) * kMostLanes);
  }
  /// See LaneArrays::PowerIndex.
  HWY_INLINE Z Power(size_t k) const {
    Z power;
#pragma GCC unroll 8
    for (size_t v = 0; v < kVectors; ++v) {
      power.re[v] = PowerRe(v, k);
      power.im[v] = PowerIm(v, k);
    }
    return power;
  }

  /// Advances `z` by whole tiles.
  HWY_INLINE void Advance(size_t tile_count, Z& z) const {
    Raise(Power(kTileNodes - 1), tile_count, z);
  }

  /// q^frame_count; frame_count is at least one.
  HWY_INLINE Z FramePower(size_t frame_count) const {
    Z q;
    q.Load(q_re, q_im);
    Z power = q;
    Raise(q, frame_count - 1, power);
    return power;
  }

  /// Renders one tile of the first kind: every sample is computed from the state at the tile's
  /// start, then the state advances by a tile.
  HWY_INLINE void AddTile(Z& z, float* mix) const { AddNodes<kTileNodes>(z, mix); }

  /// Renders the nodes of one longer tile, including the node at its end, and advances the state.
  HWY_INLINE void AddClosedTile(Z& z, float* nodes) const { AddNodes<kClosedTileNodes>(z, nodes); }

  /// Renders the first `frame_count` samples of a tile of the first kind and advances the state by
  /// `frame_count` frames.
  HWY_INLINE void AddPart(Z& z, size_t frame_count, float* HWY_RESTRICT mix) const {
    const Floats d;
    for (size_t k = 0; k < frame_count; ++k) {
      V sum = hn::Load(d, mix + k * kMostLanes);
#pragma GCC unroll 8
      for (size_t v = 0; v < kVectors; ++v) {
        if (k == 0) {
          sum = hn::Add(sum, z.re[v]);
        } else {
          sum = hn::MulAdd(z.re[v], PowerRe(v, k - 1), sum);
          sum = hn::NegMulAdd(z.im[v], PowerIm(v, k - 1), sum);
        }
      }
      hn::Store(sum, d, mix + k * kMostLanes);
    }
    if (frame_count > 0) z.Multiply(Power(frame_count - 1));
  }

 private:
  /// z *= power^exponent, by repeated squaring.
  static HWY_INLINE void Raise(Z power, size_t exponent, Z& z) {
    if (exponent == 0) return;
    for (;;) {
      if ((exponent & 1) != 0) z.Multiply(power);
      exponent >>= 1;
      if (exponent == 0) return;
      power.Multiply(Z(power));
    }
  }

  template <size_t kNodes>
  HWY_INLINE void AddNodes(Z& z, float* HWY_RESTRICT mix) const {
    const Floats d;
    V sum[kNodes];
#pragma GCC unroll 16
    for (size_t k = 0; k < kNodes; ++k) sum[k] = hn::Load(d, mix + k * kMostLanes);
#pragma GCC unroll 8
    for (size_t v = 0; v < kVectors; ++v) {
      sum[0] = hn::Add(sum[0], z.re[v]);
#pragma GCC unroll 16
      for (size_t k = 1; k < kTileNodes; ++k) {
        sum[k] = hn::MulAdd(z.re[v], PowerRe(v, k - 1), sum[k]);
        sum[k] = hn::NegMulAdd(z.im[v], PowerIm(v, k - 1), sum[k]);
      }
      z.Multiply(v, PowerRe(v, kTileNodes - 1), PowerIm(v, kTileNodes - 1));
      if constexpr (kNodes > kTileNodes) sum[kTileNodes] = hn::Add(sum[kTileNodes], z.re[v]);
    }
#pragma GCC unroll 16
    for (size_t k = 0; k < kNodes; ++k) hn::Store(sum[k], d, mix + k * kMostLanes);
  }
};

}  // namespace carillon::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target include guard
