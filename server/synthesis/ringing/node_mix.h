// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>

#include "server/synthesis/ringing/lane_arrays.h"
#include "server/synthesis/ringing/tile.h"

namespace carillon {

/// The longest block. It is bounded because single precision drifts from the state in double within
/// a block.
inline constexpr size_t kMostBlockFrames = 256;

/// Sums over modes at the nodes of tiles of the longer kinds, each still split into SIMD lanes.
class NodeMix {
 public:
  void Clear() noexcept { used_ = {}; }

  /// Returns whether the nodes of any kind were used since Clear.
  bool used() const noexcept { return used_ != std::array<bool, kTileKinds>{}; }

  /// Returns the nodes of the tiles of this kind that cover `frame_count` frames. The first use
  /// since Clear sets them to zero. Node k of tile i is at [(i * kClosedTileNodes + k) *
  /// kMostLanes].
  float* Use(size_t kind, size_t frame_count) noexcept;

  /// Interpolates the tiles and adds them to frames[begin] to frames[end - 1]. The first tile of
  /// each kind begins at frame `begin`. Reads as far as sum_kernel::AddTiles does.
  void AddTo(size_t begin, size_t end, float* frames) const noexcept;

 private:
  static constexpr std::array<size_t, kTileKinds> kMostTiles = {
      0, kMostBlockFrames / kTileFrames[1], kMostBlockFrames / kTileFrames[2]};

  /// Index of the first node of a kind.
  static constexpr std::array<size_t, kTileKinds> kFirst = {0, 0, kMostTiles[1] * kNodeFloats};

  std::array<bool, kTileKinds> used_{};
  alignas(64) std::array<float, (kMostTiles[1] + kMostTiles[2]) * kNodeFloats> nodes_;
};

}  // namespace carillon
