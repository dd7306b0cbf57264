// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>

#include "server/base/pose.h"
#include "server/synthesis/schedule/mixer_event.h"

namespace carillon {

/// A position and an orientation, and for a listener the direction to the right.
struct Place {
  std::array<double, 3> position_m{};
  std::array<double, 3> right{1, 0, 0};
  Quaternion orientation{};  ///< from the object's or listener's frame into the scene's
};

/// The place of an object or listener that is moved by Motions, block by block. The place moves in
/// straight lines and is smoothed with a lag of 10 ms, so that its velocity does not jump. At rest
/// it is exactly the last target. No function allocates or locks.
class Glide {
 public:
  Glide(const Place& place, double sample_rate_hz, size_t block_frame_count);

  /// Starts a motion at sample `offset` of this block. If its glide_frames is below one, the place
  /// jumps. Offsets ascend within a block.
  void Move(const Motion& motion, size_t offset) noexcept;

  /// Ends the block.
  void Advance() noexcept;

  /// The place at the end of the last block.
  Place place() const noexcept { return PlaceAt(smoothed_); }

  /// The place at which this block begins: the place at the end of the last block. If a motion of
  /// this block was a jump, it is the place after all motions so far.
  Place begin() const noexcept { return PlaceAt(jumps_ ? unsmoothed_ : smoothed_); }

  /// Whether the place jumped in the last block.
  bool jumped() const noexcept { return jumped_; }

  bool at_rest() const noexcept { return at_rest_; }

 private:
  static constexpr size_t kAxes = 10;  // of position, then of right, then of orientation
  using Coordinates = std::array<double, kAxes>;

  static Place PlaceAt(const Coordinates& coordinates) noexcept;
  void Go(size_t frame_count) noexcept;

  double smoothing_;  // share of the remaining distance that is covered in a block
  size_t block_frame_count_;
  size_t offset_ = 0;
  Coordinates unsmoothed_, step_{}, target_, smoothed_;
  double frames_left_ = 0;
  bool jumps_ = false, jumped_ = false, at_rest_ = true;
};

}  // namespace carillon
