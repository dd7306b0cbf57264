// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <string_view>

#include "server/synthesis/ringing/lane_arrays.h"
#include "server/synthesis/ringing/strike_batch.h"

namespace carillon {

/// Lanes of which the first `awake_count`, whole groups of kMostLanes, ring in the time domain.
struct RingingSegment {
  size_t lane_count = 0;
  size_t awake_count = 0;
  double loudest_squared = 0;  ///< largest squared amplitude, lately
};

/// A bank has no more segments.
inline constexpr size_t kMostSegments = 5;

/// The inner loops of what rings in the time domain, compiled for every SIMD target and dispatched
/// at run time. None allocates, locks or throws.
namespace ring_kernel {

/// Where values are added, by kind of tile: of the first, those of frame n of the block at
/// [n * kMostLanes]; of others, those of node k of tile i at
/// [(i * kClosedTileNodes + k) * kMostLanes]; null where no lanes are rendered in that kind.
using TileSums = std::array<float*, kTileKinds>;

/// A block in which nothing is struck.
struct FreeBlock {
  TileSums sums;
  size_t frame_count = 0;
  /// Groups of lanes whose squared amplitudes are all below this are silenced.
  double silence_squared = 0;
};

/// Adds a block of what is awake, and advances it to the next. `segments` are all there are. False:
/// something was not finite.
bool RingFreely(LaneArrays& lanes, std::span<RingingSegment> segments,
                const FreeBlock& block) noexcept;

/// A part of a block, with the strikes that fall into it, of all lanes. Longer tiles begin anew
/// with the part. The batch's states are those at the strikes' frames, of longer tiles at the begin
/// of the strike's tile; to their nodes a strike is added by itself, because only what comes after
/// it is heard (StrikeBatch::nodes).
struct StruckPart {
  TileSums sums;
  size_t begin = 0;  ///< frames
  size_t end = 0;
  /// The states at `begin` are the start and newborn ones; else that of the block's start, and
  /// nothing is newborn.
  bool started = false;
  /// All lanes go in tiles of the first kind: that is less work for many strikes.
  bool by_frames = false;
  StrikeBatch& batch;
  size_t lane_count = 0;
};

/// Sets the start and newborn states of a block that is rendered in parts.
void Start(LaneArrays& lanes, size_t lane_count) noexcept;

/// Adds a part that was started and is not the last, struck at the batch's offsets, and advances
/// the start and newborn states to its end.
void RingStruck(LaneArrays& lanes, const StruckPart& part) noexcept;

/// Adds to the start and newborn states.
void AddStrike(LaneArrays& lanes, size_t lane_count, const float* added_re,
               const float* added_im) noexcept;

/// Adds a block's last part, and advances everything to the next block, with what is newborn.
/// Silence and result as for RingFreely.
bool FinishStruck(LaneArrays& lanes, std::span<RingingSegment> segments, const StruckPart& part,
                  double silence_squared) noexcept;

/// Name of the target dispatched to.
std::string_view Target();

}  // namespace ring_kernel
}  // namespace carillon
