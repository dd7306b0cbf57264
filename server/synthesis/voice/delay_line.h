// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace carillon {

/// A delay line with fractional delays: a windowed sinc of kTaps samples interpolates between
/// samples. It is exact at whole delays, and elsewhere within -80 dB up to 0.37 of the sample rate.
/// Only the constructor allocates; nothing locks.
class DelayLine {
 public:
  static constexpr size_t kTaps = 24;
  /// The least delay: interpolation needs half of the taps after the position.
  static constexpr double kLeastDelay = kTaps / 2.0;

  /// Read can go back `longest_delay` samples before any of the last `block_frame_count` samples
  /// written.
  DelayLine(size_t longest_delay, size_t block_frame_count);

  void Write(std::span<const float> samples) noexcept;

  /// Makes all samples written so far read as zero, without overwriting them.
  void Silence() noexcept { silent_count_ = written_; }

  /// Returns the signal `delay` samples before the sample that is written next.
  float Read(double delay) const noexcept;

  /// Number of samples kept.
  size_t length() const noexcept { return mask_ + 1; }

 private:
  size_t mask_;
  std::vector<float> samples_;  // a ring buffer; the first kTaps samples are repeated at its end
  const float* phases_;         // rows of kTaps coefficients
  size_t written_ = 0;
  size_t silent_count_ = 0;  // the first samples written, which read as zero
};

}  // namespace carillon
