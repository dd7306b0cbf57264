// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <limits>

namespace carillon {

/// How a device loses frames.
enum class LossKind {
  kAnyLength,    ///< it stands still until it is started again
  kWholeCycles,  ///< its cycles go on without them (JACK)
};

/// Finds from the time stamps of a device's callbacks how much of the sound was lost where the
/// device says that it had an xrun.
///
/// When a callback is late, so is its time stamp, and the next ones are not: nothing was lost. When
/// frames were lost, the time at which frames are heard stays ahead of the frames given by as many.
/// So their difference, the lead, is watched for a second: what it has gained by then is lost.
///
/// JACK's stamps come from a loop that follows its cycles. Where its server itself was late, all
/// frames waited as long and none is missing, but the loop is thrown off: a lead that dwindles.
class OutputClock {
 public:
  OutputClock(double sample_rate_hz, LossKind kind)
      : half_watch_(static_cast<uint64_t>(sample_rate_hz / 2)),
        sample_rate_hz_(sample_rate_hz),
        kind_(kind) {}

  /// Forgets what was before; the counts stay.
  void Restart() noexcept;

  /// A callback for `frame_count` frames that are heard at `output_s`. Callbacks of one cycle of
  /// the device have the same `cycle_s` and say `underflow` alike. One thread, real-time safe.
  void Count(double cycle_s, double output_s, size_t frame_count, bool underflow) noexcept;

  /// Cycles in which the device said so. Any thread.
  uint64_t xrun_count() const { return xrun_count_.load(std::memory_order_relaxed); }

  /// Of the longest cycle so far; 0 before the first is whole. Any thread.
  size_t longest_cycle_frames() const {
    return longest_cycle_frames_.load(std::memory_order_relaxed);
  }

  /// Known a second after. Any thread.
  uint64_t lost_frame_count() const { return lost_frame_count_.load(std::memory_order_relaxed); }

 private:
  static constexpr double kNever = std::numeric_limits<double>::infinity();

  void BeginCycle(double lead_frames, bool underflow) noexcept;
  void EndStretch() noexcept;
  /// `early`, `late`: what the lead has gained half a second and a second after.
  double LostFrames(double early, double late) const noexcept;

  const uint64_t half_watch_;  ///< frames
  const double sample_rate_hz_;
  const LossKind kind_;
  double cycle_s_ = 0;  ///< of the last callback
  bool underflow_ = false;
  uint64_t given_count_ = 0;      ///< frames
  uint64_t cycle_first_ = 0;      ///< the first frame of this cycle
  double cycle_frame_count_ = 0;  ///< of the last whole cycle
  uint64_t stretch_first_ = 0;    ///< the first frame of this half second
  bool begun_ = false, watching_ = false;
  /// Least lead, for some callbacks are late: of this half second, and of the one before.
  double least_ = kNever, least_before_ = kNever;
  double usual_ = 0;  ///< lead before the xrun that is being watched
  std::atomic<size_t> longest_cycle_frames_{0};
  std::atomic<uint64_t> xrun_count_{0};
  std::atomic<uint64_t> lost_frame_count_{0};
};

}  // namespace carillon
