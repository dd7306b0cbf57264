// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <thread>

#include "absl/base/thread_annotations.h"
#include "absl/status/statusor.h"
#include "server/audio_device/block_broadcast.h"
#include "server/audio_device/look_ahead.h"
#include "server/audio_device/open_device.h"
#include "server/base/clock.h"
#include "server/base/mutex.h"
#include "server/loudness/loudness_meter.h"
#include "server/synthesis/mixer.h"

namespace carillon {

/// Settings of the daemon's output.
struct OutputSettings {
  DeviceFormat format{};
  /// Blocks rendered ahead of the device.
  uint32_t look_ahead_block_count = 8;
  /// A specification for OpenDevice.
  std::string device = "auto";
};

/// State of the output at one moment.
struct OutputState {
  std::string device;
  std::string device_message;
  double latency_s = 0;  ///< from the mixer to audible sound, as far as known
  double load = 0;       ///< fraction of real time that rendering takes
  uint64_t xrun_count = 0;
  uint64_t lost_frame_count = 0;
  double peak = 0;                        ///< largest sample of the last second, before the limiter
  std::optional<double> momentary_lufs;   ///< loudness of the last 400 ms; unset for silence
  std::optional<double> short_term_lufs;  ///< loudness of the last 3 s; unset for silence
  MixerStatistics mixer;
};

/// Plays a mixer: renders it ahead of a device, broadcasts it to listeners, and frees retired
/// memory and replaces a failed device on a housekeeping thread. All functions may be called from
/// any thread.
class LiveOutput {
 public:
  /// Takes a line for people to read.
  using Log = std::function<void(const std::string&)>;

  /// Opens the device and begins to play. `clock` must outlive the output.
  /// Errors: those of OpenDevice and of the device's Start.
  static absl::StatusOr<std::unique_ptr<LiveOutput>> Start(const OutputSettings& settings,
                                                           Clock& clock, Log log);
  ~LiveOutput();
  LiveOutput(const LiveOutput&) = delete;
  LiveOutput& operator=(const LiveOutput&) = delete;

  Mixer& mixer() { return mixer_; }
  BlockBroadcast& broadcast() { return broadcast_; }
  const DeviceFormat& format() const { return settings_.format; }
  OutputState state() const;

 private:
  LiveOutput(const OutputSettings& settings, Clock& clock, Log log);

  absl::Status Open();
  void RenderBlock(std::span<float> block);
  void KeepHouse();
  void NoteLevels();
  void ReplaceDeadDevice();

  const OutputSettings settings_;
  Clock& clock_;
  const Log log_;
  Mixer mixer_;
  BlockBroadcast broadcast_;
  LookAhead look_ahead_;
  mutable Mutex mutex_;
  OpenedDevice output_ ABSL_GUARDED_BY(mutex_);
  /// Counts of devices that have failed.
  uint64_t earlier_xrun_count_ ABSL_GUARDED_BY(mutex_) = 0;
  uint64_t earlier_lost_frame_count_ ABSL_GUARDED_BY(mutex_) = 0;
  struct Peak {
    std::chrono::nanoseconds time;
    double value;
  };
  std::deque<Peak> peaks_ ABSL_GUARDED_BY(mutex_);
  std::optional<double> momentary_lufs_ ABSL_GUARDED_BY(mutex_);
  std::optional<double> short_term_lufs_ ABSL_GUARDED_BY(mutex_);
  LoudnessMeter loudness_;  ///< used by the housekeeping thread alone
  std::atomic<bool> stopping_{false};
  std::thread housekeeper_;
};

}  // namespace carillon
