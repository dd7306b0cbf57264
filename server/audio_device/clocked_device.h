// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <functional>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include "server/audio_device/audio_device.h"
#include "server/base/clock.h"

namespace carillon {

/// A device without a sound card: a thread pulls a block each time the clock has advanced by a
/// block, and gives it to a sink. It catches up after late wake-ups, so the mean rate is exact.
class ClockedDevice final : public AudioDevice {
 public:
  /// Takes one block. False: the device has failed and pulls no more.
  using Sink = std::function<bool(std::span<const float>)>;

  /// `clock` must outlive the device.
  ClockedDevice(std::string description, const DeviceFormat& format, Clock& clock, Sink sink);
  ~ClockedDevice() override;

  absl::Status Start(FrameSource& source) override;
  void Stop() override;
  std::string description() const override { return description_; }
  double latency_s() const override { return 0; }
  bool alive() const override { return alive_.load(std::memory_order_relaxed); }
  uint64_t xrun_count() const override { return 0; }
  uint64_t lost_frame_count() const override { return 0; }

 private:
  void Run();

  const std::string description_;
  const DeviceFormat format_;
  Clock& clock_;
  const Sink sink_;
  FrameSource* source_ = nullptr;
  std::atomic<bool> alive_{true};
  std::atomic<bool> stopping_{false};
  std::thread thread_;
};

}  // namespace carillon
