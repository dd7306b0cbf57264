// SPDX-License-Identifier: Apache-2.0
#include "server/audio_device/output_clock.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace carillon {
namespace {

/// JACK's clock loses about a hundredth of its error in a cycle: a quarter in so many.
constexpr int kHalfWatchCycles = 24;
/// What is steady changes less than this, relative to the gain.
constexpr double kSteady = 0.1;
/// Stamps are not more exact.
constexpr double kLeastLossFrames = 16;

}  // namespace

void OutputClock::Restart() noexcept {
  cycle_count_ = given_count_ = 0;
  least_ = least_before_ = kNever;
  watched_count_ = 0;
}

void OutputClock::Count(double cycle_s, double output_s, size_t frame_count,
                        bool underflow) noexcept {
  // Some devices of ALSA have no clock: theirs stands still.
  if (cycle_count_ == 0 || cycle_s != cycle_s_ || (underflow && !underflow_)) {
    const double lead_frames = output_s * sample_rate_hz_ - static_cast<double>(given_count_);
    // Before the first cycle nothing was to be heard.
    BeginCycle(lead_frames, underflow && cycle_count_ > 0);
    ++cycle_count_;
  }
  cycle_s_ = cycle_s;
  underflow_ = underflow;
  given_count_ += frame_count;
}

void OutputClock::BeginCycle(double lead_frames, bool underflow) noexcept {
  if (underflow) {
    xrun_count_.fetch_add(1, std::memory_order_relaxed);
    // Of several in a row the whole is measured.
    if (watched_count_ == 0) usual_ = std::min(least_, least_before_);
    watched_count_ = 2 * kHalfWatchCycles;
    early_ = late_ = kNever;
  }
  if (watched_count_ > 0) {
    Watch(lead_frames);
  } else {
    Follow(lead_frames);
  }
}

/// The least of a stretch, for what is late now and then; of a short one, for sound card and clock
/// drift apart.
void OutputClock::Follow(double lead_frames) noexcept {
  least_ = std::min(least_, lead_frames);
  if (cycle_count_ % kHalfWatchCycles != 0) return;
  least_before_ = std::exchange(least_, kNever);
}

void OutputClock::Watch(double lead_frames) noexcept {
  double& least = watched_count_ > kHalfWatchCycles ? early_ : late_;
  least = std::min(least, lead_frames);
  if (--watched_count_ == 0) Settle();
}

void OutputClock::Settle() noexcept {
  const double gain = late_ - usual_;
  if (gain >= kLeastLossFrames && std::abs(late_ - early_) <= kSteady * gain) {
    lost_frame_count_.fetch_add(static_cast<uint64_t>(std::llround(gain)),
                                std::memory_order_relaxed);
  }
  least_ = kNever;
  least_before_ = late_;
}

}  // namespace carillon
