// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include "absl/status/statusor.h"
#include "server/audio_device/audio_device.h"
#include "server/audio_device/frame_source.h"
#include "server/audio_device/ring_buffer.h"

namespace carillon {

/// The rendered frames that wait for the device, in memory that carillon-audio, the process of a
/// sound card, maps too. The daemon's render thread writes to frames(). One device at a time pulls.
class FrameRing final : public FrameSource {
 public:
  /// Allocates memory for `block_count` blocks.
  FrameRing(const DeviceFormat& format, uint32_t block_count);

  /// Maps the memory of another process's ring, and keeps `descriptor`. Errors: Internal
  /// (AUDIO_DEVICE_FAILED: `descriptor` is not such memory).
  static absl::StatusOr<std::unique_ptr<FrameRing>> Map(int descriptor);

  ~FrameRing() override;
  FrameRing(const FrameRing&) = delete;
  FrameRing& operator=(const FrameRing&) = delete;

  RingView<float>& frames() { return frames_; }

  void Pull(std::span<float> frames) noexcept override;
  int shared_memory() const override { return descriptor_; }

  /// Number of pulls that found too few frames.
  uint64_t xrun_count() const;

  /// Number of silent frames that pulls returned in place of missing frames.
  uint64_t lost_frame_count() const;

 private:
  struct Head;
  FrameRing(int descriptor, Head& head);

  int descriptor_;
  Head& head_;
  RingView<float> frames_;
};

}  // namespace carillon
