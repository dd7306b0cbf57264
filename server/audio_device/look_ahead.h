// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <span>
#include <thread>

#include "absl/status/status.h"
#include "server/audio_device/audio_device.h"
#include "server/audio_device/frame_ring.h"
#include "server/base/clock.h"

namespace carillon {

/// Renders ahead of the device on a thread of its own, so that the device only copies. A ring
/// buffer of `block_count` blocks lies between both threads and adds their duration to the latency.
///
/// The thread polls the ring buffer for room twice in each block's duration, because waking it
/// would need a system call in the device's callback.
class LookAhead final {
 public:
  /// Fills one block. Only the render thread calls it, so it must be real-time safe.
  using RenderBlock = std::function<void(std::span<float>)>;

  /// `clock` must outlive this.
  LookAhead(const DeviceFormat& format, uint32_t block_count, RenderBlock render, Clock& clock);
  ~LookAhead();
  LookAhead(const LookAhead&) = delete;
  LookAhead& operator=(const LookAhead&) = delete;

  /// Fills the ring buffer, then starts the thread, also again after Stop. If the system refuses
  /// real-time priority, the thread runs without that priority and the refusal is returned.
  absl::Status Start();

  /// Joins the thread.
  void Stop();

  /// The frames that the device pulls.
  FrameSource& source() { return rendered_; }

  /// Latency that the ring buffer adds.
  double latency_s() const;

  /// Number of pulls that found too few frames in the ring buffer.
  uint64_t xrun_count() const { return rendered_.xrun_count(); }

  /// Number of silent frames that pulls returned in place of missing frames.
  uint64_t lost_frame_count() const { return rendered_.lost_frame_count(); }

  /// Returns the fraction of real time that rendering takes, smoothed over about a second. Above 1,
  /// rendering is too slow.
  double load() const { return load_.load(std::memory_order_relaxed); }

 private:
  void Run();
  void FillUp();
  void RenderOne();

  const DeviceFormat format_;
  const uint32_t block_count_;
  const RenderBlock render_;
  Clock& clock_;
  FrameRing rendered_;
  std::atomic<double> load_{0};
  std::atomic<bool> stopping_{false};
  std::thread thread_;
};

}  // namespace carillon
