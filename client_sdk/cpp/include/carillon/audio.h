// SPDX-License-Identifier: Apache-2.0
#pragma once

#if __cplusplus < 202002L
#error "Carillon's C++ client needs C++20: compile with -std=c++20"
#endif

#include <cstdint>
#include <functional>
#include <span>

namespace carillon::client {

/// Consecutive frames of rendered sound. A frame holds one sample for each channel.
struct AudioBlock {
  uint32_t sample_rate_hz = 0;
  uint32_t channel_count = 0;
  /// The number of frames rendered before this block since the daemon, or the offline rendering,
  /// began.
  uint64_t first_frame = 0;
  /// The number of frames that this listener has missed so far because it read too slowly. It is
  /// zero in an offline rendering.
  uint64_t lost_frame_count = 0;
  /// The samples, interleaved by channel; full scale is 1. They are valid during the callback only.
  std::span<const float> samples;
};

/// Receives the blocks in order. Returning false ends the stream.
using AudioCallback = std::function<bool(const AudioBlock&)>;

}  // namespace carillon::client
