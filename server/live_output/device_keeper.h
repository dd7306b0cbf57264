// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <thread>

#include "absl/base/thread_annotations.h"
#include "absl/status/statusor.h"
#include "server/audio_device/frame_source.h"
#include "server/audio_device/open_device.h"
#include "server/base/clock.h"
#include "server/base/mutex.h"

namespace carillon {

/// The state of the wanted device and of the device in use.
struct DeviceState {
  std::string description;  ///< device that pulls at present
  std::string message;      ///< one line about the present fault, or empty
  /// Whether the wanted device pulls and takes every frame. Also true if the wanted device is
  /// "auto" and there has never been a sound card.
  bool plays = true;
  double latency_s = 0;
  uint64_t xrun_count = 0;  ///< xruns of all devices so far
  uint64_t lost_frame_count = 0;
};

/// Plays a source on the wanted device. While that device is away, the null device pulls from the
/// source, so that time goes on, and the keeper tries to open the wanted device twice a second, or
/// more and more rarely, up to every ten seconds, if "auto" has never found a sound card.
///
///     wanted device plays --Check fails--> null pulls --opened and started--> wanted device plays
///
/// The keeper has its own thread, because opening a device may take seconds. If the null device was
/// asked for, there is nothing to keep, and no thread.
class DeviceKeeper {
 public:
  /// Takes a line of text for the operator, whenever the fault of the device changes.
  using Log = std::function<void(const std::string&)>;
  /// Takes DeviceState::plays when it may have changed.
  using Observer = std::function<void(bool plays)>;
  /// Called before the wanted device begins to pull, after Pause perhaps.
  using Wake = std::function<void()>;

  /// Plays `source`. `source` and `clock` must outlive the keeper. If a sound card does not exist
  /// yet, the keeper waits for it. Errors: InvalidArgument (INVALID_CONFIGURATION),
  /// FailedPrecondition (OUTPUT_NOT_WRITABLE, WORKER_NOT_FOUND).
  static absl::StatusOr<std::unique_ptr<DeviceKeeper>> Start(const DeviceSettings& settings,
                                                             FrameSource& source, Clock& clock,
                                                             Log log, Wake wake = nullptr);

  /// Stops the device, within 5 s.
  ~DeviceKeeper();
  DeviceKeeper(const DeviceKeeper&) = delete;
  DeviceKeeper& operator=(const DeviceKeeper&) = delete;

  DeviceState state() const;

  /// Stops a device that discards its frames, until Resume. Returns whether nothing pulls now:
  /// another device goes on.
  bool Pause();
  void Resume();

  /// Calls `observer` at once, and whenever its argument may have changed, until it is replaced by
  /// a null observer.
  void Observe(Observer observer);

 private:
  DeviceKeeper(const DeviceSettings& settings, FrameSource& source, Clock& clock, Log log,
               Wake wake);

  absl::Status Begin();
  void Run();
  void CheckDevice();
  void PlayOnNull() ABSL_EXCLUSIVE_LOCKS_REQUIRED(change_mutex_);
  void TryWanted();
  void PlayOnWanted(std::unique_ptr<AudioDevice> wanted);
  AudioDevice& device() const;
  void Install(std::unique_ptr<AudioDevice> device, bool wanted);
  void Note(const std::string& message);
  bool plays() const ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) {
    return !missed_ || (wanted_ && message_.empty());
  }

  const DeviceSettings settings_;
  FrameSource& source_;
  Clock& clock_;
  const Log log_;
  const Wake wake_;
  std::chrono::nanoseconds try_period_;
  std::chrono::nanoseconds next_try_{0};
  /// Held while a device is started, stopped or replaced, which takes up to half a second.
  Mutex change_mutex_ ABSL_ACQUIRED_BEFORE(mutex_);
  bool paused_ ABSL_GUARDED_BY(change_mutex_) = false;
  mutable Mutex mutex_;
  /// Only a thread that holds change_mutex_, too, replaces it.
  std::unique_ptr<AudioDevice> device_ ABSL_GUARDED_BY(mutex_);
  bool wanted_ ABSL_GUARDED_BY(mutex_) = false;  ///< whether device_ is the wanted device
  /// Whether silence is a fault, because a device was named or "auto" has found a device before.
  bool missed_ ABSL_GUARDED_BY(mutex_);
  std::string message_ ABSL_GUARDED_BY(mutex_);
  /// Counts of the devices that were replaced.
  uint64_t earlier_xrun_count_ ABSL_GUARDED_BY(mutex_) = 0;
  uint64_t earlier_lost_frame_count_ ABSL_GUARDED_BY(mutex_) = 0;
  Mutex observer_mutex_;
  Observer observer_ ABSL_GUARDED_BY(observer_mutex_);
  std::atomic<bool> stopping_{false};
  std::thread thread_;
};

}  // namespace carillon
