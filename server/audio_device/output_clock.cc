// SPDX-License-Identifier: Apache-2.0
#include "server/audio_device/output_clock.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace carillon {
namespace {

/// The clocks of sound card and system may drift apart by 0.3 ms in a second, so less is no loss.
constexpr double kLeastLossS = 0.001;
/// JACK's loop is of second order and has a bandwidth of 1/8 Hz. A unit disturbance decays as
/// exp(-x) (cos x - sin x) with x = 0.555 t: to 0.52 after half a second and to 0.19 after one.
constexpr double kLeftOfDecrease = 0.19 / (0.52 - 0.19);

}  // namespace

void OutputClock::Restart() noexcept {
  begun_ = watching_ = false;
  given_count_ = cycle_first_ = stretch_first_ = 0;
  least_ = least_before_ = kNever;
}

void OutputClock::Count(double cycle_s, double output_s, size_t frame_count,
                        bool underflow) noexcept {
  // Some ALSA devices have no clock; their time stamps do not change.
  if (!begun_ || cycle_s != cycle_s_ || (underflow && !underflow_)) {
    // An underflow before the first cycle loses nothing.
    BeginCycle(output_s * sample_rate_hz_ - static_cast<double>(given_count_), underflow && begun_);
    begun_ = true;
  }
  cycle_s_ = cycle_s;
  underflow_ = underflow;
  given_count_ += frame_count;
}

void OutputClock::BeginCycle(double lead_frames, bool underflow) noexcept {
  const uint64_t frames = given_count_ - std::exchange(cycle_first_, given_count_);
  cycle_frame_count_ = static_cast<double>(frames);
  if (frames > longest_cycle_frames()) {
    longest_cycle_frames_.store(frames, std::memory_order_relaxed);
  }
  if (underflow) {
    xrun_count_.fetch_add(1, std::memory_order_relaxed);
    // Several xruns in a row are measured as one.
    if (!watching_) usual_ = std::min(least_, least_before_);
    watching_ = true;
    stretch_first_ = given_count_;
    least_ = least_before_ = kNever;
  }
  least_ = std::min(least_, lead_frames);
  if (given_count_ - stretch_first_ >= half_watch_) EndStretch();
}

void OutputClock::EndStretch() noexcept {
  if (watching_ && least_before_ != kNever) {
    const double lost = LostFrames(least_before_ - usual_, least_ - usual_);
    lost_frame_count_.fetch_add(static_cast<uint64_t>(std::llround(lost)),
                                std::memory_order_relaxed);
    watching_ = false;
  }
  least_before_ = std::exchange(least_, kNever);
  stretch_first_ = given_count_;
}

double OutputClock::LostFrames(double early, double late) const noexcept {
  if (kind_ == LossKind::kAnyLength) return late < kLeastLossS * sample_rate_hz_ ? 0 : late;
  const double gain = late - kLeftOfDecrease * (early - late);
  return std::max(0.0, std::round(gain / cycle_frame_count_)) * cycle_frame_count_;
}

}  // namespace carillon
