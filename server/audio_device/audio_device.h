// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "absl/status/status.h"
#include "server/audio_device/frame_source.h"

namespace carillon {

/// What a device must run at.
struct DeviceFormat {
  uint32_t sample_rate_hz = 48000;
  /// Frames of every pull.
  uint32_t block_frame_count = 128;
  /// Samples of a frame: 1 or 2.
  uint32_t channel_count = 1;

  size_t block_size() const { return size_t{block_frame_count} * channel_count; }
};

/// Somewhere to play. A new kind of device is a new implementation of this and a line in
/// open_device.cc.
///
/// Start, Stop and the destructor are called from one thread; the rest from any.
class AudioDevice {
 public:
  /// Stops.
  virtual ~AudioDevice() = default;

  /// Begins to pull from `source`, which must live until Stop has returned.
  virtual absl::Status Start(FrameSource& source) = 0;

  /// Ends pulling: once it has returned the source is not touched again. Stopping twice is no
  /// error.
  virtual void Stop() = 0;

  /// "portaudio: NAME", "null" or "file: PATH".
  virtual std::string description() const = 0;

  /// From a pull to the ear as far as the device knows, seconds; valid from its second pull on.
  virtual double latency_s() const = 0;

  /// False once a started device has died by itself (its server went away, its disk is full).
  virtual bool alive() const = 0;

  /// Times that the device itself reported frames missed, beyond those its source counts.
  virtual uint64_t xrun_count() const = 0;

  /// Frames by which its time has gone on without those of its source, as far as its clock tells.
  virtual uint64_t lost_frame_count() const = 0;
};

}  // namespace carillon
