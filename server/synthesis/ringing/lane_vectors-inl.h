// SPDX-License-Identifier: Apache-2.0

// SIMD vectors of lanes, compiled for each target. Only kernels include this file, within
// foreach_target.
#if defined(CARILLON_SERVER_SYNTHESIS_LANE_VECTORS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef CARILLON_SERVER_SYNTHESIS_LANE_VECTORS_INL_H_
#undef CARILLON_SERVER_SYNTHESIS_LANE_VECTORS_INL_H_
#else
#define CARILLON_SERVER_SYNTHESIS_LANE_VECTORS_INL_H_
#endif

#include <hwy/highway.h>

#include "server/synthesis/ringing/lane_arrays.h"

HWY_BEFORE_NAMESPACE();
namespace carillon::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using Floats = hn::CappedTag<float, kMostLanes>;
using Doubles = hn::Repartition<double, Floats>;
using HalfFloats = hn::Half<Floats>;
using V = hn::Vec<Floats>;

// This squared amplitude is far above any sound, and far below the largest float.
constexpr float kMostSquared = 1e30F;

/// Collects the squared amplitudes of some lanes while they advance.
struct Loudness {
  hn::Vec<Doubles> loudest;
  hn::Vec<Doubles> all_small;  ///< zero in lanes where an amplitude was too large or NaN

  HWY_INLINE void Clear() {
    loudest = hn::Zero(Doubles());
    all_small = hn::Set(Doubles(), 1.0);
  }
  HWY_INLINE void Note(hn::Vec<Doubles> squared) {
    const Doubles d;
    loudest = hn::Max(loudest, squared);
    all_small = hn::IfThenElseZero(hn::Le(squared, hn::Set(d, double{kMostSquared})), all_small);
  }
  HWY_INLINE void Join(const Loudness& other) {
    loudest = hn::Max(loudest, other.loudest);
    all_small = hn::Min(all_small, other.all_small);
  }
  HWY_INLINE bool Above(double squared) const {
    const Doubles d;
    return !hn::AllFalse(d, hn::Gt(loudest, hn::Set(d, squared)));
  }
  HWY_INLINE bool Finite() const {
    return hn::AllTrue(Doubles(), hn::Gt(all_small, hn::Zero(Doubles())));
  }
  HWY_INLINE double Loudest() const { return hn::GetLane(hn::MaxOfLanes(Doubles(), loudest)); }
};

}  // namespace carillon::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target include guard
