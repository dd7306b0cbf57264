// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>

#include "server/synthesis/ringing/tile.h"

/// From what is still split into the lanes of a vector to samples, compiled for every SIMD target
/// and dispatched at run time. Nothing here allocates, locks or throws.
namespace carillon::sum_kernel {

/// block[n] = the sum of the lanes at mix[n * kMostLanes].
void SumLanes(const float* mix, std::span<float> block) noexcept;

/// Tiles of one kind, of which the first begins at frame `begin`; those before `end` are heard.
struct Tiles {
  size_t kind = 0;
  size_t begin = 0;
  size_t end = 0;
};

/// Adds what tiles on end sound like to frames[begin] to frames[end - 1]; up to kMostLanes - 1
/// frames more are read, and written as they are. Node k of tile i is the sum of the lanes at
/// nodes[(i * kClosedTileNodes + k) * kMostLanes].
void AddTiles(const Tiles& tiles, const float* nodes, float* frames) noexcept;

/// The same of strikes, ascending by offset: each with nodes of its own, `node_stride` further than
/// those of the one before, for the tile that it falls into, where it is heard from its offset on.
void AddStruckTiles(const Tiles& tiles, std::span<const size_t> offsets, const float* nodes,
                    size_t node_stride, float* frames) noexcept;

}  // namespace carillon::sum_kernel
