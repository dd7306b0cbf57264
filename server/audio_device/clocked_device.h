// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <functional>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "server/audio_device/audio_device.h"
#include "server/base/clock.h"
#include "server/base/mutex.h"

namespace carillon {

/// A device without a sound card: a thread pulls a block each time the clock has advanced by a
/// block, and gives it to a sink. The thread catches up after late wake-ups, so the mean rate is
/// exact. It keeps time as a sound card does: in place of frames that are not ready, for instance
/// because the process was stopped, the source gives silence, and counts them as lost.
class ClockedDevice final : public AudioDevice {
 public:
  /// Takes one block. After an error that block is lost, and the sink gets the next block as usual.
  using Sink = std::function<absl::Status(std::span<const float>)>;

  /// `clock` must outlive the device.
  ClockedDevice(std::string description, const DeviceFormat& format, Clock& clock, Sink sink);
  ~ClockedDevice() override;

  absl::Status Start(FrameSource& source) override;
  void Stop() override;
  bool discards() const override { return sink_ == nullptr; }
  std::string description() const override { return description_; }
  double latency_s() const override { return 0; }
  absl::Status Check() override;
  uint64_t xrun_count() const override { return 0; }
  uint64_t lost_frame_count() const override {
    return lost_frame_count_.load(std::memory_order_relaxed);
  }

 private:
  void Run();
  void GiveToSink(std::span<const float> block);

  const std::string description_;
  const DeviceFormat format_;
  Clock& clock_;
  const Sink sink_;
  FrameSource* source_ = nullptr;
  std::atomic<uint64_t> lost_frame_count_{0};
  Mutex mutex_;
  /// The sink's result for the newest block.
  absl::Status state_ ABSL_GUARDED_BY(mutex_);
  std::atomic<bool> stopping_{false};
  std::thread thread_;
};

}  // namespace carillon
