// SPDX-License-Identifier: Apache-2.0
#include "server/scene/time_mapping.h"

#include <cmath>
#include <utility>

#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/shortest_decimal.h"

namespace carillon {
namespace {

/// Fewest late steps in a row that show that the following steps will be late, too.
constexpr uint64_t kFewestLateSteps = 3;

}  // namespace

absl::Status CheckTimeScale(double scale, uint64_t step) {
  if (scale == 0 || (scale >= 0.001 && scale <= 1000)) return absl::OkStatus();
  return Refusal(absl::StatusCode::kInvalidArgument, "INVALID_STREAM",
                 absl::StrCat("time_scale of step ", step, " is ", ShortestDecimal(scale),
                              "; it must be 0 in a pause, or 0.001 to 1000"));
}

void TimeMapper::Begin(double time_s, uint64_t frame) {
  mapping_ = {.first_frame = frame,
              .first_time_s = time_s,
              .delay_s = mapping_.delay_s,
              .scale_before = mapping_.scale,
              .scale = mapping_.scale};
}

void TimeMapper::SetScale(double time_s, double scale) {
  if (scale == mapping_.scale) return;
  mapping_.bend_sound_s = mapping_.SoundS(time_s);
  mapping_.bend_s = time_s - mapping_.first_time_s;
  mapping_.scale_before = std::exchange(mapping_.scale, scale);
}

void TimeMapper::Pause(double before_s, double time_s, double sound_s) {
  mapping_.bend_sound_s = mapping_.SoundS(before_s) + sound_s;
  mapping_.bend_s = time_s - mapping_.first_time_s;
  mapping_.scale_before = mapping_.scale;
}

void TimeMapper::MapLater(double late_frames) {
  const double block_count =
      std::ceil((late_frames + mapping_.delay_s * sample_rate_hz_) / double{kOfflineBlockFrames});
  mapping_.first_frame += static_cast<uint64_t>(block_count) * kOfflineBlockFrames;
  since_frame_.reset();
}

bool TimeMapper::EndsPause(double late_frames, uint64_t frame) {
  if (late_frames < kLateRunS * sample_rate_hz_) return false;
  if (resumed_ &&
      static_cast<double>(frame - resumed_->frame) < kBetweenPausesS * sample_rate_hz_) {
    ++remap_count_;
  }
  resumed_ = {.frame = frame, .first_frame_before = mapping_.first_frame};
  MapLater(late_frames);
  return true;
}

bool TimeMapper::UndoesPause(double time_s, uint64_t frame) {
  if (!resumed_ || static_cast<double>(frame - resumed_->frame) > kLateRunS * sample_rate_hz_) {
    return false;
  }
  TimeMapping before = mapping_;
  before.first_frame = resumed_->first_frame_before;
  if (before.FrameOf(time_s, sample_rate_hz_) < static_cast<double>(frame)) return false;
  mapping_ = before;
  resumed_.reset();
  return true;
}

void TimeMapper::Note(double time_s, uint64_t frame, bool resumes) {
  if (UndoesPause(time_s, frame)) return;
  const double late_frames = static_cast<double>(frame) - FrameOf(time_s);
  if (resumes && late_frames > 0) return MapLater(late_frames);
  if (!since_frame_ && EndsPause(late_frames, frame)) return;
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
  MapLater(late_frames);
  ++remap_count_;
}

}  // namespace carillon
