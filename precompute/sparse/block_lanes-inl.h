// SPDX-License-Identifier: AGPL-3.0-or-later
// Vectors across the columns of a block, once for each SIMD target; included by kernels only,
// within foreach_target.
#if defined(CARILLON_PRECOMPUTE_MODES_BLOCK_LANES_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef CARILLON_PRECOMPUTE_MODES_BLOCK_LANES_INL_H_
#undef CARILLON_PRECOMPUTE_MODES_BLOCK_LANES_INL_H_
#else
#define CARILLON_PRECOMPUTE_MODES_BLOCK_LANES_INL_H_
#endif

#include <hwy/highway.h>

#include <algorithm>

#include "precompute/sparse/node_matrix.h"

HWY_BEFORE_NAMESPACE();
namespace carillon::precompute::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

template <typename Real>
using Lanes = hn::CappedTag<Real, kBlockWidth>;

template <typename Real>
constexpr int LaneCount() {
  return std::min(kBlockWidth, static_cast<int>(HWY_MAX_BYTES / sizeof(Real)));
}

/// Columns of kWidth that are worked on at once: two vectors, as many as registers allow for the
/// rows kept beside them.
template <typename Real, int kWidth = kBlockWidth>
constexpr int Chunk() {
  return std::min(kWidth, 2 * LaneCount<Real>());
}

}  // namespace carillon::precompute::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target include guard
