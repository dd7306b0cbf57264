// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>

#include "server/synthesis/ringing/lane_arrays.h"
#include "server/synthesis/ringing/tile.h"

namespace carillon {

/// Blocks are no longer than this: single-precision coefficients drift from the double state within
/// a block.
inline constexpr size_t kMostBlockFrames = 256;

/// Sums over modes at the nodes of tiles longer than the first kind's, still split into the lanes
/// of a vector.
class NodeMix {
 public:
  void Clear() noexcept { used_ = {}; }

  /// The nodes of this kind's tiles, the first ones of which cover `frame_count` frames; silent at
  /// the first use. Node k of tile i is [(i * kClosedTileNodes + k) * kMostLanes].
  float* Use(size_t kind, size_t frame_count) noexcept;

  /// Adds what the tiles sound like, of which the first of each kind begins at `begin`, to
  /// frames[begin] to frames[end - 1]; reads as far as sum_kernel::AddTiles.
  void AddTo(size_t begin, size_t end, float* frames) const noexcept;

 private:
  static constexpr std::array<size_t, kTileKinds> kMostTiles = {
      0, kMostBlockFrames / kTileFrames[1], kMostBlockFrames / kTileFrames[2]};

  /// Where the nodes of a kind are.
  static constexpr std::array<size_t, kTileKinds> kFirst = {0, 0, kMostTiles[1] * kNodeFloats};

  std::array<bool, kTileKinds> used_{};
  alignas(64) std::array<float, (kMostTiles[1] + kMostTiles[2]) * kNodeFloats> nodes_;
};

}  // namespace carillon
