// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace carillon {

/// Keeps the last samples, to be read anywhere between them: a windowed sinc of kTaps samples,
/// exact at whole delays, within -80 dB up to 0.37 of the sample rate between. Neither allocates
/// nor locks once made.
class DelayLine {
 public:
  static constexpr size_t kTaps = 24;
  /// What was written last can be read with this delay or more.
  static constexpr double kLeastDelay = kTaps / 2.0;

  /// Delays up to `longest_delay` samples, read while the last `block_frame_count` are new.
  DelayLine(size_t longest_delay, size_t block_frame_count);

  void Write(std::span<const float> samples) noexcept;

  /// The sample `delay` before the one that is written next.
  float Read(double delay) const noexcept;

  /// Samples that are kept.
  size_t length() const noexcept { return mask_ + 1; }

 private:
  size_t mask_;
  std::vector<float> samples_;  // and the first kTaps once more at the end
  const float* phases_;         // rows of kTaps
  size_t written_ = 0;
};

}  // namespace carillon
