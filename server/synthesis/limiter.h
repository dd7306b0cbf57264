// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace carillon {

/// Keeps samples within +-1. It tracks the signal's envelope, e(n) = max(|x(n)|, release
/// e(n-1)), and above the threshold T = 10^(-3/20) it applies the gain f(e)/e with
///
///   f(e) = T + (1 - T) u/(1 + u),  u = (e - T)/(1 - T)
///
/// f has slope one at T and limit one. Samples below T pass unchanged. There is no delay; the gain
/// recovers with a time constant of 0.1 s. A sample that is not finite becomes zero. A sample
/// beyond +-32 is clipped to +-32 first, so that the gain recovers from any sample within half a
/// second. All channels of a frame get the gain of the loudest channel, so that the stereo image
/// does not move.
class Limiter {
 public:
  explicit Limiter(double sample_rate_hz, size_t channel_count = 1);

  /// Limits `block`, interleaved, in place; returns the number of frames it changed.
  uint64_t Apply(std::span<float> block) noexcept;

 private:
  size_t channel_count_;
  float release_;
  float envelope_ = 0;
};

}  // namespace carillon
