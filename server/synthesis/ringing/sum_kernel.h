// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>

#include "server/synthesis/ringing/tile.h"

/// Sums SIMD lanes and nodes to samples, compiled for every SIMD target and dispatched at run time.
/// Nothing here allocates, locks or throws.
namespace carillon::sum_kernel {

/// block[n] = the sum of the lanes at mix[n * kMostLanes].
void SumLanes(const float* mix, std::span<float> block) noexcept;

/// Consecutive tiles of one kind. The first begins at frame `begin`; frames from `end` on are not
/// rendered.
struct Tiles {
  size_t kind = 0;
  size_t begin = 0;
  size_t end = 0;
};

/// Interpolates tiles and adds them to frames[begin] to frames[end - 1]; up to kMostLanes - 1
/// frames more are read and written back unchanged. Node k of tile i is the sum of the lanes at
/// nodes[(i * kClosedTileNodes + k) * kMostLanes].
void AddTiles(const Tiles& tiles, const float* nodes, float* frames) noexcept;

/// Interpolates the onsets at `offsets`, which ascend, and adds each from its offset to the end of
/// the tile that it falls into. The nodes of onset i begin at nodes[i * node_stride].
void AddStruckTiles(const Tiles& tiles, std::span<const size_t> offsets, const float* nodes,
                    size_t node_stride, float* frames) noexcept;

}  // namespace carillon::sum_kernel
