// SPDX-License-Identifier: Apache-2.0
#include "server/synthesis/bank/long_segment.h"

#include <algorithm>
#include <utility>

namespace carillon {

void LongSegment::TakeFromTime(size_t index, RingingSegment& from, LaneArrays& time) noexcept {
  for (const LaneRun& run : time.runs) {
    if (run.segment != index) continue;
    const size_t awake_count = run.CountOfFirst(from.awake_count);
    for (size_t i = 0; i < awake_count; ++i) {
      lanes.re[run.first_in_segment + i] += time.re[run.range.first + i];
      lanes.im[run.first_in_segment + i] += time.im[run.range.first + i];
    }
    time.Silence({run.range.first, awake_count});
  }
  std::fill_n(lanes.awake.begin(), from.awake_count / kMostLanes, uint8_t{1});
  awake |= from.awake_count > 0;
  from.awake_count = 0;
}

void LongSegment::GiveToTime(size_t index, RingingSegment& to, LaneArrays& time) noexcept {
  if (!awake) return;
  for (const LaneRun& run : time.runs) {
    if (run.segment != index) continue;
    for (size_t i = 0; i < run.range.count; ++i) {
      time.re[run.range.first + i] += std::exchange(lanes.re[run.first_in_segment + i], 0);
      time.im[run.range.first + i] += std::exchange(lanes.im[run.first_in_segment + i], 0);
    }
  }
  std::ranges::fill(lanes.awake, uint8_t{0});
  awake = false;
  to.awake_count = to.lane_count;
}

void LongSegment::Silence() noexcept {
  std::fill_n(lanes.re.data(), lanes.awake.size() * kMostLanes, 0.0);
  std::fill_n(lanes.im.data(), lanes.awake.size() * kMostLanes, 0.0);
  std::ranges::fill(lanes.awake, uint8_t{0});
  awake = sounding = false;
}

void LongSegment::Scale(double factor) noexcept {
  for (size_t i = 0; i < lanes.awake.size() * kMostLanes; ++i) {
    lanes.re[i] *= factor;
    lanes.im[i] *= factor;
  }
  loudest_squared *= factor * factor;
}

}  // namespace carillon
