// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <span>

namespace carillon::client {

/// Some consecutive frames of a stream.
struct AudioBlock {
  uint32_t sample_rate_hz = 0;
  uint32_t channel_count = 0;
  /// Number of the first frame since the daemon, or the rendering, began.
  uint64_t first_frame = 0;
  /// Frames this listener has lost so far because it did not read fast enough; zero when rendering.
  uint64_t lost_frame_count = 0;
  /// Interleaved, full scale is 1; valid during the callback only.
  std::span<const float> samples;
};

/// Gets every block in order; false ends the stream.
using AudioCallback = std::function<bool(const AudioBlock&)>;

}  // namespace carillon::client
