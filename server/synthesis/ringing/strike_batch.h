// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include "server/synthesis/ringing/lane_arrays.h"
#include "server/synthesis/ringing/node_mix.h"

namespace carillon {

/// Strikes of one bank within a block that are rendered in one pass over its lanes: what each adds
/// to the states, and at which frame. Workspace of one rendering thread.
class StrikeBatch {
 public:
  static constexpr size_t kMostStrikes = 32;
  /// A bank has no more lanes, and projects no more columns, than this.
  static constexpr size_t kMostBankLanes = 16384;

  /// Rows that the next strike will read: asked for while this one is worked on, because at once
  /// they would only wait for each other.
  struct RowsAhead {
    std::array<const int16_t*, 12> rows{};
    size_t count = 0;
    size_t value_count = 0;  ///< of each
  };

  StrikeBatch()
      : modal_impulses_(kMostBankLanes),
        re_(kMostBankLanes),
        im_(kMostBankLanes),
        nodes_(kMostStrikes * kNodeStride) {}

  /// How many strikes of a bank of `lane_count` lanes fit.
  static size_t Capacity(size_t lane_count) {
    return lane_count == 0 ? kMostStrikes : std::min(kMostStrikes, kMostBankLanes / lane_count);
  }

  float* modal_impulses() noexcept { return modal_impulses_.data(); }
  float* re(size_t strike, size_t lane_count) noexcept { return re_.data() + strike * lane_count; }
  float* im(size_t strike, size_t lane_count) noexcept { return im_.data() + strike * lane_count; }

  /// What the strike adds to the nodes of its tile of this kind, not the first; node k is
  /// [k * kMostLanes].
  float* nodes(size_t strike, size_t tile_kind) noexcept {
    return nodes_.data() + strike * kNodeStride + (tile_kind - 1) * kNodeFloats;
  }
  static constexpr size_t kNodeStride = (kTileKinds - 1) * kNodeFloats;

  /// Of a part of a block by itself.
  NodeMix part_nodes;

  RowsAhead ahead;
  /// Impulses in this block, of all batches, of the bank that is being struck; merged ones are one.
  size_t due_count = 0;
  size_t count = 0;
  std::array<size_t, kMostStrikes> offsets{};  ///< in the block, ascending

 private:
  LaneArray<float> modal_impulses_;  // by column
  LaneArray<float> re_, im_;         // by strike, then by lane
  LaneArray<float> nodes_;           // by strike, then by kind
};

}  // namespace carillon
