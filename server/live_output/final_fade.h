// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstddef>
#include <span>

#include "server/audio_device/audio_device.h"

namespace carillon {

/// Fades the sound out when the daemon stops, by 50 ms of a raised cosine, because an abrupt end is
/// heard as a click.
class FinalFade {
 public:
  explicit FinalFade(const DeviceFormat& format);

  /// Begins the fade. Any thread may call it.
  void Begin() noexcept { begun_.store(true, std::memory_order_relaxed); }

  /// Returns whether a silent block has been rendered. Any thread may call it.
  bool ended() const noexcept { return ended_.load(std::memory_order_relaxed); }

  /// Applies the fade to a block. The render thread calls it with each block. Real-time safe.
  void Apply(std::span<float> block) noexcept;

 private:
  double Gain() const noexcept;

  const size_t channel_count_;
  const double frame_count_;  ///< frames of the fade
  double frame_ = 0;          ///< next frame of the fade
  std::atomic<bool> begun_{false};
  std::atomic<bool> ended_{false};
};

}  // namespace carillon
