// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <limits>

namespace carillon {

/// Finds from the time stamps of a device's callbacks how much of the sound was lost where the
/// device says that it had an xrun.
///
/// When the device is late, so is the time stamp, and the next ones are not: nothing was lost. When
/// frames were lost, the time at which frames are heard stays ahead of the frames given by as many.
/// So their difference is watched for some cycles of the device: what it has steadily gained is
/// lost. A gain that dwindles is a clock that finds its way back after the device itself was late
/// (JACK's, of its graph: its frames wait as long as everybody else does, and none is missing).
class OutputClock {
 public:
  explicit OutputClock(double sample_rate_hz) : sample_rate_hz_(sample_rate_hz) {}

  /// Forgets what was before; the counts stay.
  void Restart() noexcept;

  /// A callback for `frame_count` frames that are heard at `output_s`. Callbacks of one cycle of
  /// the device have the same `cycle_s` and say `underflow` alike. One thread, real-time safe.
  void Count(double cycle_s, double output_s, size_t frame_count, bool underflow) noexcept;

  /// Cycles in which the device said so. Any thread.
  uint64_t xrun_count() const { return xrun_count_.load(std::memory_order_relaxed); }

  /// Known about half a second after. Any thread.
  uint64_t lost_frame_count() const { return lost_frame_count_.load(std::memory_order_relaxed); }

 private:
  static constexpr double kNever = std::numeric_limits<double>::infinity();

  void BeginCycle(double lead_frames, bool underflow) noexcept;
  void Follow(double lead_frames) noexcept;
  void Watch(double lead_frames) noexcept;
  void Settle() noexcept;

  const double sample_rate_hz_;
  double cycle_s_ = 0;  ///< of the last callback
  bool underflow_ = false;
  uint64_t given_count_ = 0;  ///< frames
  uint64_t cycle_count_ = 0;
  /// Least lead lately: of this stretch of cycles, and of the one before.
  double least_ = kNever, least_before_ = kNever;
  double usual_ = 0;                       ///< lead before the xrun that is being watched
  int watched_count_ = 0;                  ///< cycles left; zero: none is watched
  double early_ = kNever, late_ = kNever;  ///< least lead in both halves of the watch
  std::atomic<uint64_t> xrun_count_{0};
  std::atomic<uint64_t> lost_frame_count_{0};
};

}  // namespace carillon
