// SPDX-License-Identifier: Apache-2.0
#include "server/synthesis/ringing/sum_kernel.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "server/synthesis/ringing/sum_kernel.cc"
// foreach_target.h includes this file once for each target, and must come first.
// clang-format off
#include <hwy/foreach_target.h>
#include <hwy/highway.h>
#include "server/synthesis/ringing/lane_vectors-inl.h"
// clang-format on

#include <algorithm>

HWY_BEFORE_NAMESPACE();
namespace carillon::sum_kernel {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;
using carillon::HWY_NAMESPACE::Floats;
using carillon::HWY_NAMESPACE::V;

constexpr size_t kLanes = hn::MaxLanes(Floats());

/// Sums each kWidth neighbouring lanes of the sets kFirst and following; sets from kCount on count
/// as zero.
template <size_t kWidth, size_t kFirst, size_t kCount>
HWY_INLINE V SumNeighbours(const float* HWY_RESTRICT lanes) {
  if constexpr (kFirst >= kCount) {
    return hn::Zero(Floats());
  } else if constexpr (kWidth == 1) {
    return hn::Load(Floats(), lanes + kFirst * kMostLanes);
#if HWY_TARGET != HWY_SCALAR
  } else {
    constexpr size_t kHalf = kWidth / 2;
    const V low = SumNeighbours<kHalf, kFirst, kCount>(lanes);
    const V high = SumNeighbours<kHalf, kFirst + kHalf, kCount>(lanes);
    return hn::Add(hn::ConcatEven(Floats(), high, low), hn::ConcatOdd(Floats(), high, low));
#endif
  }
}

/// sums[i] = the sum of the i-th set of lanes; `sums` has room for whole vectors.
template <size_t kCount, size_t kFirst = 0>
HWY_INLINE void SumEach(const float* HWY_RESTRICT lanes, float* HWY_RESTRICT sums) {
  hn::StoreU(SumNeighbours<kLanes, kFirst, kCount>(lanes), Floats(), sums + kFirst);
  if constexpr (kFirst + kLanes < kCount) SumEach<kCount, kFirst + kLanes>(lanes, sums);
}

/// Each frame has kMostLanes lanes, of which kernels use as many as a vector has.
void SumLanes(const float* mix, std::span<float> block) {
  size_t n = 0;
  for (; n + kLanes <= block.size(); n += kLanes) {
    SumEach<kLanes>(mix + n * kMostLanes, block.data() + n);
  }
  for (; n < block.size(); ++n) {
    block[n] = hn::GetLane(SumNeighbours<kLanes, 0, 1>(mix + n * kMostLanes));
  }
}

/// Interpolates the sums of a tile's nodes at frames `begin` to `end`; the tile begins at `first`.
HWY_INLINE void AddFrames(const NodeShares& shares, const float* sums, size_t first, size_t begin,
                          size_t end, float* HWY_RESTRICT frames) {
  const Floats d;
  for (size_t n = begin; n < end; n += kLanes) {
    V sum = hn::Zero(d);
#pragma GCC unroll 9
    for (size_t k = 0; k < kClosedTileNodes; ++k) {
      const V share = hn::LoadU(d, shares[k].data() + (n - first));
      sum = hn::MulAdd(hn::Set(d, sums[k]), share, sum);
    }
    sum = hn::IfThenElseZero(hn::FirstN(d, end - n), sum);
    hn::StoreU(hn::Add(hn::LoadU(d, frames + n), sum), d, frames + n);
  }
}

void AddTiles(const Tiles& tiles, const float* nodes, float* frames) {
  const size_t frame_count = kTileFrames[tiles.kind];
  const NodeShares& shares = GetNodeShares(tiles.kind);
  for (size_t first = tiles.begin; first < tiles.end; first += frame_count) {
    float sums[kClosedTileNodes + kMostLanes];
    SumEach<kClosedTileNodes>(nodes, sums);
    AddFrames(shares, sums, first, first, std::min(first + frame_count, tiles.end), frames);
    nodes += kNodeFloats;
  }
}

void AddStruckTiles(const Tiles& tiles, std::span<const size_t> offsets, const float* nodes,
                    size_t node_stride, float* frames) {
  const size_t frame_count = kTileFrames[tiles.kind];
  const NodeShares& shares = GetNodeShares(tiles.kind);
  float all[kClosedTileNodes] = {};
  size_t tile_end = 0;
  for (size_t i = 0; i < offsets.size(); ++i) {
    const size_t first = offsets[i] - (offsets[i] - tiles.begin) % frame_count;
    if (first >= tile_end) std::fill_n(all, kClosedTileNodes, 0.0F);
    tile_end = first + frame_count;
    float sums[kClosedTileNodes + kMostLanes];
    SumEach<kClosedTileNodes>(nodes + i * node_stride, sums);
    for (size_t k = 0; k < kClosedTileNodes; ++k) all[k] += sums[k];
    size_t end = std::min(tile_end, tiles.end);
    if (i + 1 < offsets.size()) end = std::min(end, offsets[i + 1]);
    AddFrames(shares, all, first, offsets[i], end, frames);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace carillon::sum_kernel
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace carillon::sum_kernel {
HWY_EXPORT(SumLanes);
HWY_EXPORT(AddTiles);
HWY_EXPORT(AddStruckTiles);

void SumLanes(const float* mix, std::span<float> block) noexcept {
  HWY_DYNAMIC_DISPATCH(SumLanes)(mix, block);
}

void AddTiles(const Tiles& tiles, const float* nodes, float* frames) noexcept {
  HWY_DYNAMIC_DISPATCH(AddTiles)(tiles, nodes, frames);
}

void AddStruckTiles(const Tiles& tiles, std::span<const size_t> offsets, const float* nodes,
                    size_t node_stride, float* frames) noexcept {
  HWY_DYNAMIC_DISPATCH(AddStruckTiles)(tiles, offsets, nodes, node_stride, frames);
}

}  // namespace carillon::sum_kernel
#endif
