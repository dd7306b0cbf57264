// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace carillon {

/// A gain that glides to each new value within 30 ms, along 3t^2 - 2t^3. The slope of this curve
/// has no step, so neither the glide nor its ends click. One thread at a time uses it; it neither
/// allocates nor locks.
class Fader {
 public:
  explicit Fader(double sample_rate_hz, float gain = 1);

  /// Begins to glide to `gain` from the present value. The call has no effect if `gain` is the
  /// target already.
  void GlideTo(float gain) noexcept;

  /// Sets the gain at once.
  void JumpTo(float gain) noexcept;

  /// Whether the gain is one and stays so.
  bool neutral() const noexcept { return resting() && to_ == 1; }

  /// Whether the gain has arrived.
  bool resting() const noexcept { return frame_ == frame_count_; }

  float target() const noexcept { return to_; }

  /// Multiplies `gains` by the gains of the next frames.
  void Multiply(std::span<float> gains) noexcept;

 private:
  float Now() const noexcept;

  uint32_t frame_count_;  // of a glide
  uint32_t frame_;        // of this glide
  float from_, to_;
};

}  // namespace carillon
