// SPDX-License-Identifier: AGPL-3.0-or-later
// SIMD vectors along the columns of a block. Only kernels include this file, once for each SIMD
// target, by foreach_target.
#if defined(CARILLON_PRECOMPUTE_MODES_BLOCK_LANES_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef CARILLON_PRECOMPUTE_MODES_BLOCK_LANES_INL_H_
#undef CARILLON_PRECOMPUTE_MODES_BLOCK_LANES_INL_H_
#else
#define CARILLON_PRECOMPUTE_MODES_BLOCK_LANES_INL_H_
#endif

#include <hwy/highway.h>

#include <algorithm>

#include "precompute/sparse/block_kernels.h"

HWY_BEFORE_NAMESPACE();
namespace carillon::precompute::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

template <typename Real>
using Lanes = hn::CappedTag<Real, kBlockWidth>;

template <typename Real>
constexpr int LaneCount() {
  return std::min(kBlockWidth, static_cast<int>(HWY_MAX_BYTES / sizeof(Real)));
}

/// Returns how many of kWidth columns a kernel processes at once. These are at most two vectors for
/// each row, because a kernel keeps the sums of several rows in registers, and more vectors would
/// not fit.
template <typename Real, int kWidth = kBlockWidth>
constexpr int Chunk() {
  return std::min(kWidth, 2 * LaneCount<Real>());
}

}  // namespace carillon::precompute::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target include guard
