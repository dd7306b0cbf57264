// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>

#include "server/synthesis/schedule/mixer_event.h"

namespace carillon {

/// Where something is: a point, and, of a listener, the direction to its right.
struct Place {
  std::array<double, 3> position_m{};
  std::array<double, 3> right{1, 0, 0};
};

/// The way of something that is told where to go, block by block: straight from place to place,
/// smoothed so that its velocity does not jump either (a lag of 10 ms). At rest it is exactly where
/// it was told. Neither allocates nor locks.
class Glide {
 public:
  Glide(const Place& place, double sample_rate_hz, size_t block_frame_count);

  /// Goes to a place from sample `offset` of this block on; without a glide it jumps there. Offsets
  /// within a block do not go back.
  void Move(const Motion& motion, size_t offset) noexcept;

  /// Ends the block.
  void Advance() noexcept;

  /// At the end of the last block.
  Place place() const noexcept;

  /// It jumped in the last block.
  bool jumped() const noexcept { return jumped_; }

  bool at_rest() const noexcept { return at_rest_; }

 private:
  static constexpr size_t kAxes = 6;  // of position, then of right
  using Coordinates = std::array<double, kAxes>;

  void Go(size_t frame_count) noexcept;

  double smoothing_;  // how much of what is left a block takes
  size_t block_frame_count_;
  size_t offset_ = 0;
  Coordinates told_, step_{}, target_, smooth_;
  double frames_left_ = 0;
  bool jumps_ = false, jumped_ = false, at_rest_ = true;
};

}  // namespace carillon
