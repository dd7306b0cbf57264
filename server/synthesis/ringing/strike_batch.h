// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include "server/synthesis/ringing/lane_arrays.h"
#include "server/synthesis/ringing/node_mix.h"

namespace carillon {

/// Onsets (impulses and knots) of one bank within a block, which are rendered in one pass over the
/// lanes. The batch has the frame of each onset and the change that it makes to the states. A batch
/// is scratch memory of one rendering thread.
class StrikeBatch {
 public:
  static constexpr size_t kMostStrikes = 32;
  /// Most lanes, and most projected columns, of a bank.
  static constexpr size_t kMostBankLanes = 16384;

  /// The vertices whose rows of the shape table the next impulse will read. They are prefetched
  /// piece by piece while the present impulse is processed, because simultaneous requests would
  /// wait for each other.
  struct RowsAhead {
    std::array<const int16_t*, 12> rows{};
    size_t count = 0;
    size_t value_count = 0;  ///< of the three rows of a vertex, which are consecutive
  };

  StrikeBatch()
      : modal_impulses_(kMostBankLanes),
        re_(kMostBankLanes),
        im_(kMostBankLanes),
        nodes_(kMostStrikes * kNodeStride) {}

  /// Number of onsets that fit for a bank of `lane_count` lanes.
  static size_t Capacity(size_t lane_count) {
    return lane_count == 0 ? kMostStrikes : std::min(kMostStrikes, kMostBankLanes / lane_count);
  }

  float* modal_impulses() noexcept { return modal_impulses_.data(); }
  float* re(size_t strike, size_t lane_count) noexcept { return re_.data() + strike * lane_count; }
  float* im(size_t strike, size_t lane_count) noexcept { return im_.data() + strike * lane_count; }

  /// The nodes of an onset's own tile of a longer kind; node k is at [k * kMostLanes].
  float* nodes(size_t strike, size_t tile_kind) noexcept {
    return nodes_.data() + strike * kNodeStride + (tile_kind - 1) * kNodeFloats;
  }
  static constexpr size_t kNodeStride = (kTileKinds - 1) * kNodeFloats;

  /// Nodes of a part of a block that is not the whole block.
  NodeMix part_nodes;

  RowsAhead ahead;
  /// Impulses of the present bank in this block, in all batches; merged impulses count as one.
  size_t due_count = 0;
  size_t count = 0;
  std::array<size_t, kMostStrikes> offsets{};  ///< in the block, ascending

 private:
  LaneArray<float> modal_impulses_;  // by column
  LaneArray<float> re_, im_;         // by strike, then by lane
  LaneArray<float> nodes_;           // by strike, then by kind
};

}  // namespace carillon
