// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>
#include <string_view>

#include "server/synthesis/lane_arrays.h"
#include "server/synthesis/strike_batch.h"

namespace carillon {

/// Lanes of which those before `awake_count`, whole groups of kMostLanes, ring in the time domain.
struct RingingSegment {
  LaneRange range;
  size_t awake_count = 0;
  double loudest_squared = 0;  ///< largest squared amplitude, lately
};

/// The inner loops of what rings in the time domain, compiled for every SIMD target and dispatched
/// at run time. Frame n of a block is added at mix[n * kMostLanes]. None allocates, locks or
/// throws.
namespace ring_kernel {

/// A block in which nothing is struck.
struct FreeBlock {
  size_t frame_count = 0;
  /// Groups of lanes whose squared amplitudes are all below this are silenced.
  double silence_squared = 0;
};

/// Adds a block of what is awake, and advances it to the next. False: something was not finite.
bool RingFreely(LaneArrays& lanes, std::span<RingingSegment> segments, const FreeBlock& block,
                float* mix) noexcept;

/// A part of a block, with the strikes that fall into it, of all lanes.
struct StruckPart {
  size_t begin = 0;  ///< frames
  size_t end = 0;
  /// The states at `begin` are the start and newborn ones; else that of the block's start, and
  /// nothing is newborn.
  bool started = false;
  StrikeBatch& batch;
  size_t lane_count = 0;
};

/// Sets the start and newborn states of a block that is rendered in parts.
void Start(LaneArrays& lanes, size_t lane_count) noexcept;

/// Adds a part that was started and is not the last, struck at the batch's offsets, and advances
/// the start and newborn states to its end.
void RingStruck(LaneArrays& lanes, const StruckPart& part, float* mix) noexcept;

/// Adds to the start and newborn states.
void AddStrike(LaneArrays& lanes, size_t lane_count, const float* added_re,
               const float* added_im) noexcept;

/// Adds a block's last part, and advances everything to the next block, with what is newborn.
/// `segments` are all there are, in order. Silence and result as for RingFreely.
bool FinishStruck(LaneArrays& lanes, std::span<RingingSegment> segments, const StruckPart& part,
                  double silence_squared, float* mix) noexcept;

/// Writes the sum of each frame's lanes.
void SumLanes(const float* mix, std::span<float> block) noexcept;

/// Name of the target dispatched to.
std::string_view Target();

}  // namespace ring_kernel
}  // namespace carillon
