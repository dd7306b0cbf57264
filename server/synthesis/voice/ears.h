// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "server/synthesis/voice/head.h"

namespace carillon {

/// The two ears of a listener, which filter the signal of one object block by block. Each ear's
/// response changes linearly from that at the start of a block to that at its end. Only the
/// constructor allocates; nothing locks.
class Ears {
 public:
  Ears(const Head& head, size_t block_frame_count);

  /// Begins a block that starts with the responses at the end of the previous block, and ends with
  /// the head's responses for `direction`. `head` must have the same tap count as the head that the
  /// constructor got.
  void Turn(const Head& head, const Vector3& direction) noexcept;

  /// Begins a block that has the responses for `direction` throughout, without a transition. Before
  /// Filter, the caller must write the frames that past() returns.
  void Jump(const Head& head, const Vector3& direction) noexcept;

  /// Begins a block that keeps the responses at the end of the previous block.
  void Hold() noexcept;

  /// Sets the signals before the block to zero.
  void Silence() noexcept;

  /// Returns the frames of an ear's signal before the block that its response reaches. The caller
  /// sets them before Filter. The span is empty if they are known from the previous block.
  std::span<float> past(size_t ear) noexcept {
    return known_[ear] ? std::span<float>() : std::span(signals_[ear]).first(past_count());
  }

  /// Returns the signal at an ear in this block, which the caller sets before Filter.
  std::span<float> signal(size_t ear) noexcept {
    return std::span(signals_[ear]).subspan(past_count());
  }

  /// Writes the block of the sound in an ear to `sound`, and ends the block for this ear.
  void Filter(size_t ear, std::span<float> sound) noexcept;

 private:
  size_t past_count() const noexcept { return end_[0].taps.size() - 1; }

  EarResponses start_, end_;
  std::array<bool, 2> known_{};
  std::array<std::vector<float>, 2> signals_;  // the past, then the block
  std::vector<float> other_;                   // the block, filtered by the end response
};

}  // namespace carillon
