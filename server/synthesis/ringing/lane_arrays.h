// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <new>
#include <vector>

#include "server/synthesis/ringing/tile.h"

namespace carillon {

/// The widest vector of floats that any SIMD target uses; arrays over modes are padded to it.
inline constexpr size_t kMostLanes = 16;

/// Number of floats in the nodes of a longer tile, each node still split into lanes.
inline constexpr size_t kNodeFloats = kClosedTileNodes * kMostLanes;

/// A zeroed array aligned for the widest vector.
template <typename T>
class LaneArray {
 public:
  explicit LaneArray(size_t size)
      : values_(static_cast<T*>(::operator new(size * sizeof(T), kAlignment))) {
    std::uninitialized_fill_n(values_.get(), size, T{});
  }
  T* data() noexcept { return values_.get(); }
  const T* data() const noexcept { return values_.get(); }
  T& operator[](size_t i) noexcept { return values_[i]; }

 private:
  static constexpr std::align_val_t kAlignment{64};
  struct Delete {
    void operator()(T* values) const noexcept { ::operator delete(values, kAlignment); }
  };
  std::unique_ptr<T[], Delete> values_;
};

/// Lanes [first, first + count), whole groups of kMostLanes.
struct LaneRange {
  size_t first = 0;
  size_t count = 0;
};

/// A run: consecutive lanes of one segment that are rendered in tiles of one kind.
struct LaneRun {
  LaneRange range;
  size_t tile_kind = 0;
  size_t segment = 0;
  size_t first_in_segment = 0;  ///< position of the run's first lane in its segment

  /// Number of this run's lanes among the first `count` lanes of the segment.
  size_t CountOfFirst(size_t count) const {
    return std::clamp(count, first_in_segment, first_in_segment + range.count) - first_in_segment;
  }
};

/// Coefficients and states in the time domain, one lane for each mode or companion of a bank.
///
/// The lanes of a bank are sorted by kind of tile, longest tiles first, then by segment; a run has
/// one kind of tile and one segment, and is padded to groups of kMostLanes. Segment 0 stays in the
/// time domain; segment 1 + k can move to long blocks of kind k. In this example two segments use
/// tiles of 64 frames, and segment 1 has lanes in all three kinds of tile:
///
///   tiles of      64 frames             16 frames        8 frames
///           +------------+-----------+------------+------------+------------+
///   runs    |  segment 1 | segment 2 |  segment 1 |  segment 0 |  segment 1 |
///           +------------+-----------+------------+------------+------------+
///   lanes   0            32          48           80           96          112
struct LaneArrays {
  /// `lane_count` is a multiple of kMostLanes.
  explicit LaneArrays(size_t lane_count);

  /// Index in `powers` of the real part of a lane's power of q that advances from the tile's start
  /// to node k + 1, or for the last k to the next tile. The imaginary part is kMostLanes further.
  static size_t PowerIndex(size_t lane, size_t k) {
    return (lane / kMostLanes * kTileNodes + k) * 2 * kMostLanes + lane % kMostLanes;
  }

  /// Appends a run of `lane_count` lanes; runs come in order of kTileOrder.
  void Add(size_t lane_count, size_t tile_kind, size_t segment, size_t first_in_segment);

  /// Sets the state at the start of the block to zero.
  void Silence(LaneRange range) noexcept;

  /// All runs, in the order of their lanes.
  std::vector<LaneRun> runs;
  /// The range of lanes of each kind of tile.
  std::array<LaneRange, kTileKinds> by_tile;
  /// Powers of q, interleaved for groups of kMostLanes lanes: see PowerIndex.
  LaneArray<float> powers;
  /// q_re and q_im: q, the factor by which a mode's state advances in one frame. step_re and
  /// step_im: q^8, by which the state advances in a tile of kind 0, which has 8 frames.
  LaneArray<float> q_re, q_im, step_re, step_im;
  /// q^N for a block of N frames.
  LaneArray<double> block_re, block_im;
  /// The state at the start of the block.
  LaneArray<double> re, im;
  /// For a block rendered in parts: `start` is the whole state at the start of the next part, in
  /// single precision; `fresh` is the part of it that impulses and forces added in this block.
  LaneArray<float> start_re, start_im;
  LaneArray<float> fresh_re, fresh_im;

  /// Factor from modal impulse to state: -i exp(i phase) c / omega_d, times all scales.
  LaneArray<float> gain_re, gain_im;
  /// Logarithm of q, which each frame of lead adds to the exponent.
  LaneArray<float> lead_re, lead_im;
  /// s = sigma + i omega of the lane's mode, 1/s, from which a contact's factor is computed.
  LaneArray<float> contact_re, contact_im;
  /// The mode's column among the projected columns.
  LaneArray<uint32_t> column;
  /// The octave of the mode's damped frequency (OctaveGains).
  LaneArray<uint32_t> octave;
};

}  // namespace carillon
