// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <semaphore>
#include <span>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/status/statusor.h"
#include "server/audio_device/block_broadcast.h"
#include "server/audio_device/look_ahead.h"
#include "server/base/clock.h"
#include "server/base/mutex.h"
#include "server/live_output/device_keeper.h"
#include "server/live_output/final_fade.h"
#include "server/live_output/loss_log.h"
#include "server/live_output/stems.h"
#include "server/loudness/loudness_meter.h"
#include "server/synthesis/mixer.h"

namespace carillon {

/// The settings of the daemon's output.
struct OutputSettings {
  DeviceFormat format{};
  /// Blocks rendered ahead of the device.
  uint32_t look_ahead_block_count = 8;
  /// See DeviceSettings::specification.
  std::string device = "auto";
  /// Path of carillon-audio, which opens sound cards.
  std::string device_program{};
  double full_scale_pa = kFullScalePa;  ///< the pressure of a sample of 1
  /// Time without sound, streams and listeners after which the null device pauses. It is longer
  /// than the loudness meter's memory.
  std::chrono::nanoseconds pause_after = std::chrono::seconds(4);
};

/// The volume of the output.
struct OutputVolume {
  double gain = 1;  ///< linear
  bool muted = false;
};

/// State of the output at one moment.
struct OutputState {
  std::string device;
  bool device_plays = true;    ///< see DeviceState::plays
  std::string device_message;  ///< one line about the device's fault, or empty
  double latency_s = 0;        ///< delay from the mixer to audible sound, as far as known
  double load = 0;             ///< fraction of real time that rendering takes
  uint64_t xrun_count = 0;
  uint64_t lost_frame_count = 0;
  double peak = 0;                        ///< largest sample of the last second, before the limiter
  std::optional<double> momentary_lufs;   ///< loudness of the last 400 ms; absent for silence
  std::optional<double> short_term_lufs;  ///< loudness of the last 3 s; absent for silence
  MixerStatistics mixer;
};

/// Renders a mixer ahead of a device that a DeviceKeeper keeps playing, broadcasts the sound to
/// listeners, and frees retired memory on a housekeeping thread. All functions may be called from
/// any thread.
///
/// On the null device the output pauses once nothing has sounded for a while, no contact stream is
/// open, and nobody listens: nothing needs the frames then. A stream or a listener ends the pause
/// at once. The mixer's frames go on with time meanwhile, because the housekeeping thread renders
/// the silent blocks that are due, many at a time.
class LiveOutput {
 public:
  /// Takes a line for people to read.
  using Log = DeviceKeeper::Log;

  /// Opens the device and starts to play. `clock` must outlive the output. Errors: those of
  /// DeviceKeeper::Start.
  static absl::StatusOr<std::unique_ptr<LiveOutput>> Start(const OutputSettings& settings,
                                                           Clock& clock, Log log);
  ~LiveOutput();
  LiveOutput(const LiveOutput&) = delete;
  LiveOutput& operator=(const LiveOutput&) = delete;

  Mixer& mixer() { return mixer_; }

  /// Adds a listener, to one bus or, without a bus, to the whole sound; see
  /// BlockBroadcast::Subscribe.
  absl::StatusOr<std::unique_ptr<BlockBroadcast::Listener>> Listen(std::optional<BusId> bus,
                                                                   std::function<void()> wake);

  /// Returns whether rendering pauses.
  bool paused() const;

  const DeviceFormat& format() const { return settings_.format; }
  double full_scale_pa() const { return settings_.full_scale_pa; }
  OutputVolume volume() const;
  /// Changes the gain and the mute switch, each if it is present. The volume glides within 30 ms.
  /// Returns the new volume.
  OutputVolume ChangeVolume(std::optional<double> gain, std::optional<bool> muted);
  OutputState state() const;

  /// Calls `observer` at once, and whenever the wanted device may have begun or ceased to play,
  /// until it is replaced by a null observer.
  void ObserveDevice(DeviceKeeper::Observer observer) { keeper_->Observe(std::move(observer)); }

  /// Fades the sound out within 50 ms, and returns when the device has played the fade. The output
  /// stays silent.
  void FadeOut();

 private:
  LiveOutput(const OutputSettings& settings, Clock& clock, Log log);

  absl::Status Open();
  void RenderBlock(std::span<float> block);
  /// Ends a pause, and lets none begin for a while.
  void Wake();
  /// Begins or ends a pause, and renders what is due in it. Returns whether rendering pauses.
  bool KeepPace();
  bool IsHeard() const;
  bool MayPause() const;
  void Pause() ABSL_EXCLUSIVE_LOCKS_REQUIRED(pause_mutex_);
  void Resume() ABSL_EXCLUSIVE_LOCKS_REQUIRED(pause_mutex_);
  void RenderDueSilence() ABSL_EXCLUSIVE_LOCKS_REQUIRED(pause_mutex_);
  void KeepHouse();
  void Deliver();
  void NoteLevels();
  void NoteLosses();

  const OutputSettings settings_;
  Clock& clock_;
  const Log log_;
  Mixer mixer_;
  BlockBroadcast broadcast_;
  Stems stems_;
  LookAhead look_ahead_;
  FinalFade final_fade_;
  std::unique_ptr<DeviceKeeper> keeper_;
  /// Held while a pause begins, ends, or renders.
  mutable Mutex pause_mutex_;
  bool paused_ ABSL_GUARDED_BY(pause_mutex_) = false;
  /// The newest time at which rendering was needed.
  std::chrono::nanoseconds needed_at_ ABSL_GUARDED_BY(pause_mutex_){};
  /// When the pause began, and the mixer's frame then.
  std::chrono::nanoseconds paused_at_ ABSL_GUARDED_BY(pause_mutex_){};
  uint64_t paused_frame_ ABSL_GUARDED_BY(pause_mutex_) = 0;
  std::vector<float> silence_ ABSL_GUARDED_BY(pause_mutex_);
  std::counting_semaphore<> woken_{0};  ///< ends a wait of the housekeeping thread
  std::atomic<bool> heard_{false};      ///< whether rendering wakes it
  mutable Mutex mutex_;
  OutputVolume volume_ ABSL_GUARDED_BY(mutex_);
  struct Peak {
    std::chrono::nanoseconds time;
    double value;
  };
  std::deque<Peak> peaks_ ABSL_GUARDED_BY(mutex_);
  std::optional<double> momentary_lufs_ ABSL_GUARDED_BY(mutex_);
  std::optional<double> short_term_lufs_ ABSL_GUARDED_BY(mutex_);
  LoudnessMeter loudness_;  ///< used only by the housekeeping thread
  LossLog loss_log_;        ///< used only by the housekeeping thread
  std::atomic<bool> stopping_{false};
  std::thread housekeeper_;
};

}  // namespace carillon
