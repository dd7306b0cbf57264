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

/// What the nodes of a longer tile take while they are split into lanes.
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

/// Lanes of one segment that are rendered in tiles of one kind.
struct LaneRun {
  LaneRange range;
  size_t tile_kind = 0;
  size_t segment = 0;
  size_t first_in_segment = 0;  ///< lanes of the segment that are in runs before

  /// How many of these lanes are among the first `count` of the segment.
  size_t CountOfFirst(size_t count) const {
    return std::clamp(count, first_in_segment, first_in_segment + range.count) - first_in_segment;
  }
};

/// The figures of a bank's modes as they ring in the time domain, one lane each.
struct LaneArrays {
  /// `lane_count` is a multiple of kMostLanes.
  explicit LaneArrays(size_t lane_count);

  /// Where the power of lane's q is that leads to node k + 1 of its tile, the last to the next
  /// tile: real part; its imaginary part is kMostLanes further.
  static size_t PowerIndex(size_t lane, size_t k) {
    return (lane / kMostLanes * kTileNodes + k) * 2 * kMostLanes + lane % kMostLanes;
  }

  /// Places so many lanes more behind all others; in order of their tiles' kind.
  void Add(size_t lane_count, size_t tile_kind, size_t segment, size_t first_in_segment);

  /// Zeroes the state at the start of the block.
  void Silence(LaneRange range) noexcept;

  /// All lanes, by kind of tile and then by segment.
  std::vector<LaneRun> runs;
  std::array<LaneRange, kTileKinds> by_tile;
  /// For each kMostLanes lanes together, see PowerIndex.
  LaneArray<float> powers;
  /// q, and its power that leads from one tile of the first kind to the next.
  LaneArray<float> q_re, q_im, step_re, step_im;
  /// q^N for a block of N frames.
  LaneArray<double> block_re, block_im;
  /// The state at the start of the block.
  LaneArray<double> re, im;
  /// Where a block is rendered in parts: the state in single precision at the start of the next
  /// part, and that of what was struck in this block.
  LaneArray<float> start_re, start_im;
  LaneArray<float> newborn_re, newborn_im;

  /// From modal impulse to state: -i exp(i phase) c / omega_d with all scales.
  LaneArray<float> gain_re, gain_im;
  /// Logarithm of q, for each frame of lead.
  LaneArray<float> lead_re, lead_im;
  /// s^2/2 of the Gaussian contact, for each second squared of tau^2.
  LaneArray<float> tau_re, tau_im;
  /// Where among the projected columns.
  LaneArray<uint32_t> column;
};

}  // namespace carillon
