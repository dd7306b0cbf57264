// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <string_view>

#include "server/synthesis/ringing/lane_arrays.h"
#include "server/synthesis/ringing/strike_batch.h"

namespace carillon {

/// A segment of lanes. Its first `awake_count` lanes, whole groups of kMostLanes, ring in the time
/// domain.
struct RingingSegment {
  size_t lane_count = 0;
  size_t awake_count = 0;
  double loudest_squared = 0;  ///< largest squared amplitude at the end of the last block
};

/// Most segments of a bank.
inline constexpr size_t kMostSegments = 5;

/// The inner loops of ringing in the time domain, compiled for every SIMD target and dispatched at
/// run time. None allocates, locks or throws.
namespace ring_kernel {

/// Destinations of the rendered values, by kind of tile. For the first kind, frame n of the block
/// is at [n * kMostLanes]; for the others, node k of tile i is at [(i * kClosedTileNodes + k) *
/// kMostLanes]. Null if no lanes are rendered in that kind.
using TileSums = std::array<float*, kTileKinds>;

/// Complex gains by which the states of all lanes are multiplied before they are rendered. If null,
/// the states themselves are rendered.
struct Gains {
  const float* re = nullptr;
  const float* im = nullptr;
};

/// The buffers that the lanes are rendered to, and their gains.
struct Output {
  TileSums sums{};
  Gains gains{};
};

/// A block without impulses.
struct FreeBlock {
  Output output;
  /// A second rendering of the same states with other gains; there is none if it has no sums.
  Output second{};
  size_t frame_count = 0;
  /// Groups of lanes whose squared amplitudes are all below this are silenced.
  double silence_squared = 0;
};

/// Renders a block of all awake lanes and advances them to the next block. `segments` are all
/// segments of the bank. Returns false if a state was not finite.
bool RingFreely(LaneArrays& lanes, std::span<RingingSegment> segments,
                const FreeBlock& block) noexcept;

/// Says which part of a block all lanes render, and which impulses fall into that part. Tiles begin
/// anew with the part. The batch's states are those at the impulses' frames; in longer tiles, those
/// at the start of the impulse's tile. In longer tiles each impulse has nodes of its own
/// (StrikeBatch::nodes), because only the frames after it are audible.
struct StruckPart {
  TileSums sums;
  Gains gains{};     ///< for HearStruck only
  size_t begin = 0;  ///< frames
  size_t end = 0;
  /// If true, the state at `begin` is read from start_re/fresh_re, because an earlier part was
  /// rendered. If false, this is the block's first part: the state is read from re/im, and the
  /// fresh state is zero.
  bool started = false;
  /// Render all lanes in tiles of the first kind, which is less work if there are many impulses.
  bool by_frames = false;
  StrikeBatch& batch;
  size_t lane_count = 0;

  /// Returns whether any lanes are rendered in tiles of the longer kinds.
  bool HasLongTiles() const noexcept { return sums[1] != nullptr || sums[2] != nullptr; }
};

/// Initializes the start and fresh states (see LaneArrays) before the first part of a block that is
/// rendered in parts.
void Start(LaneArrays& lanes, size_t lane_count) noexcept;

/// Renders a part of a block, except the block's last part, with the impulses of the part's batch.
/// Start() must have been called for the block. Advances the start and fresh states to the end of
/// the part.
void RingStruck(LaneArrays& lanes, const StruckPart& part) noexcept;

/// Renders a part with its gains, and leaves all states as they are.
void HearStruck(const LaneArrays& lanes, const StruckPart& part) noexcept;

/// Adds the contribution of an impulse to the start and fresh states.
void AddStrike(LaneArrays& lanes, size_t lane_count, const float* added_re,
               const float* added_im) noexcept;

/// Renders the block's last part, advances all states to the next block and adds the fresh states.
/// `silence_squared` and the result are those of RingFreely.
bool FinishStruck(LaneArrays& lanes, std::span<RingingSegment> segments, const StruckPart& part,
                  double silence_squared) noexcept;

/// Returns the name of the SIMD target in use.
std::string_view Target();

}  // namespace ring_kernel
}  // namespace carillon
