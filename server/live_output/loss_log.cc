// SPDX-License-Identifier: Apache-2.0
#include "server/live_output/loss_log.h"

#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"

namespace carillon {
namespace {

/// The gaps have ended when there was none for this time.
constexpr std::chrono::seconds kQuietTime(60);

}  // namespace

LossLog::LossLog(uint32_t sample_rate_hz, Log log)
    : sample_rate_hz_(sample_rate_hz), log_(std::move(log)) {}

void LossLog::Note(uint64_t lost_frame_count, std::chrono::nanoseconds now, bool explained) {
  const uint64_t lost_now = lost_frame_count - std::exchange(seen_count_, lost_frame_count);
  // Frames that the device lost just before its fault was found, or that were lost while it was
  // replaced, belong to the fault.
  const bool is_gap = lost_now > 0 && !explained && !was_explained_;
  was_explained_ = explained;
  if (is_gap && !last_gap_) {
    log_(absl::StrCat("the sound has gaps: ", Text(lost_now),
                      " were lost, because the machine is too busy to render or play in time, or "
                      "because the daemon was stopped"));
    last_gap_ = now;
  }
  if (!last_gap_) return;
  gap_frame_count_ += lost_now;
  // A fault of the device is no end of the gaps.
  if (lost_now > 0 || explained) last_gap_ = now;
  if (now - *last_gap_ < kQuietTime) return;
  log_(absl::StrCat("the sound has had no gaps for ", kQuietTime.count(), " s; ",
                    Text(gap_frame_count_), " were lost while it had some"));
  last_gap_.reset();
  gap_frame_count_ = 0;
}

std::string LossLog::Text(uint64_t frame_count) const {
  return absl::StrFormat("%d frames (%.3g s)", frame_count,
                         static_cast<double>(frame_count) / sample_rate_hz_);
}

}  // namespace carillon
