// SPDX-License-Identifier: Apache-2.0
#include "server/scene/due_frame.h"

#include <cmath>

namespace carillon {
namespace {

/// Fewest late steps in a row that show that the following steps will be late, too.
constexpr uint64_t kFewestLateSteps = 3;

}  // namespace

void TimeMapper::Begin(double time_s, uint64_t frame) {
  mapping_.first_frame = frame;
  mapping_.first_time_s = time_s;
}

void TimeMapper::Note(double time_s, uint64_t frame) {
  const double late_frames = static_cast<double>(frame) - FrameOf(time_s);
  if (late_frames <= 0) {
    since_frame_.reset();
    return;
  }
  if (!since_frame_) {
    since_frame_ = frame;
    step_count_ = 0;
  }
  ++step_count_;
  const auto run_frames = static_cast<double>(frame - *since_frame_);
  if (step_count_ < kFewestLateSteps || run_frames < kLateRunS * sample_rate_hz_) return;
  const double block_count =
      std::ceil((late_frames + mapping_.delay_s * sample_rate_hz_) / double{kOfflineBlockFrames});
  mapping_.first_frame += static_cast<uint64_t>(block_count) * kOfflineBlockFrames;
  since_frame_.reset();
  ++remap_count_;
}

}  // namespace carillon
