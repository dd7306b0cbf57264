// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "absl/status/status.h"
#include "server/audio_device/frame_source.h"

namespace carillon {

/// The format in which a device plays.
struct DeviceFormat {
  uint32_t sample_rate_hz = 48000;
  /// Frames in each pull.
  uint32_t block_frame_count = 128;
  /// Samples in a frame: 1 or 2.
  uint32_t channel_count = 1;

  size_t block_size() const { return size_t{block_frame_count} * channel_count; }
};

/// A device that plays sound. A new kind of device is a new implementation of this interface and a
/// line in open_device.cc.
///
/// One thread at a time calls Start, Check, Stop and the destructor; any thread may call the
/// others.
class AudioDevice {
 public:
  /// Stops the device.
  virtual ~AudioDevice() = default;

  /// Begins to pull from `source`, which must live until Stop has returned. Start returns quickly,
  /// because all slow steps are done when the device is opened. A device that discards may be
  /// started again after Stop.
  virtual absl::Status Start(FrameSource& source) = 0;

  /// Ends pulling. The device does not use the source after Stop has returned. Stop may be called
  /// twice.
  virtual void Stop() = 0;

  /// Returns whether all frames are thrown away, so that the device may be stopped while nobody
  /// waits for its source.
  virtual bool discards() const { return false; }

  /// "portaudio: NAME", "null" or "file: PATH".
  virtual std::string description() const = 0;

  /// Returns the seconds from a pull to audible sound, as far as the device knows them. Valid from
  /// the second pull on.
  virtual double latency_s() const = 0;

  /// Returns OK while the device plays. Unavailable means that the device has failed (for instance
  /// because its server went away) and must be replaced. After any other error (such as a full
  /// disk) the device loses frames at present, but keeps trying.
  virtual absl::Status Check() = 0;

  /// Number of times that the device itself reported missed frames. Xruns of the source are not
  /// included.
  virtual uint64_t xrun_count() const = 0;

  /// Number of frames taken from the source that were never played or written. For a sound card,
  /// the number is estimated from the time stamps of its callbacks (output_clock.h).
  virtual uint64_t lost_frame_count() const = 0;
};

}  // namespace carillon
