// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <limits>

namespace carillon {

/// How a device loses frames.
enum class LossKind {
  kAnyLength,    ///< the device stops until it is restarted
  kWholeCycles,  ///< the device skips whole cycles (JACK)
};

/// Computes from the time stamps of a device's callbacks how many frames were lost when the device
/// reported an xrun.
///
/// The lead is the device's time in frames minus the number of frames given to it. If a callback is
/// just late, its time stamp is late too, but the following ones are not, and the lead returns. If
/// frames were lost, the lead stays larger by their number. So the lead is observed for a second
/// after an xrun, and its increase is the number of lost frames.
///
/// JACK computes its time stamps by a feedback loop that follows its cycles. If the JACK server
/// itself was late, all frames were delayed and none was lost, but the feedback loop is disturbed:
/// the lead first increases and then decays.
class OutputClock {
 public:
  OutputClock(double sample_rate_hz, LossKind kind)
      : half_watch_(static_cast<uint64_t>(sample_rate_hz / 2)),
        sample_rate_hz_(sample_rate_hz),
        kind_(kind) {}

  /// Forgets earlier callbacks, but keeps the counts.
  void Restart() noexcept;

  /// Counts a callback for `frame_count` frames that will be heard at `output_s`. Callbacks of the
  /// same cycle of the device have the same `cycle_s` and `underflow`. Only one thread may call
  /// Count, which is real-time safe.
  void Count(double cycle_s, double output_s, size_t frame_count, bool underflow) noexcept;

  /// Number of cycles in which the device reported an underflow. Any thread may call it.
  uint64_t xrun_count() const { return xrun_count_.load(std::memory_order_relaxed); }

  /// Frames of the longest cycle so far; 0 before the first cycle is complete. Any thread may call
  /// it.
  size_t longest_cycle_frames() const {
    return longest_cycle_frames_.load(std::memory_order_relaxed);
  }

  /// Number of lost frames. The loss of an xrun is included a second after the xrun. Any thread may
  /// call it.
  uint64_t lost_frame_count() const { return lost_frame_count_.load(std::memory_order_relaxed); }

 private:
  static constexpr double kNever = std::numeric_limits<double>::infinity();

  void BeginCycle(double lead_frames, bool underflow) noexcept;
  void EndStretch() noexcept;
  /// Returns the number of lost frames. `early` and `late` are the increases of the lead half a
  /// second and a second after the xrun.
  double LostFrames(double early, double late) const noexcept;

  const uint64_t half_watch_;  ///< frames
  const double sample_rate_hz_;
  const LossKind kind_;
  double cycle_s_ = 0;  ///< time stamp of the last callback's cycle
  bool underflow_ = false;
  uint64_t given_count_ = 0;      ///< frames given to the device
  uint64_t cycle_first_ = 0;      ///< the first frame of this cycle
  double cycle_frame_count_ = 0;  ///< frames of the last whole cycle
  uint64_t stretch_first_ = 0;    ///< the first frame of this half second
  bool begun_ = false, watching_ = false;
  /// Least lead of this and of the previous half second. The minimum ignores late callbacks.
  double least_ = kNever, least_before_ = kNever;
  double usual_ = 0;  ///< lead before the xrun that is being observed
  std::atomic<size_t> longest_cycle_frames_{0};
  std::atomic<uint64_t> xrun_count_{0};
  std::atomic<uint64_t> lost_frame_count_{0};
};

}  // namespace carillon
