// SPDX-License-Identifier: Apache-2.0
#include "server/synthesis/ringing/lane_arrays.h"

#include <algorithm>

namespace carillon {

LaneArrays::LaneArrays(size_t lane_count)
    : powers(lane_count * 2 * kTileNodes),
      q_re(lane_count),
      q_im(lane_count),
      step_re(lane_count),
      step_im(lane_count),
      block_re(lane_count),
      block_im(lane_count),
      re(lane_count),
      im(lane_count),
      start_re(lane_count),
      start_im(lane_count),
      fresh_re(lane_count),
      fresh_im(lane_count),
      gain_re(lane_count),
      gain_im(lane_count),
      lead_re(lane_count),
      lead_im(lane_count),
      contact_re(lane_count),
      contact_im(lane_count),
      column(lane_count),
      octave(lane_count) {}

void LaneArrays::Add(size_t lane_count, size_t tile_kind, size_t segment, size_t first_in_segment) {
  const size_t first = runs.empty() ? 0 : runs.back().range.first + runs.back().range.count;
  if (by_tile[tile_kind].count == 0) by_tile[tile_kind].first = first;
  by_tile[tile_kind].count += lane_count;
  runs.push_back({.range = {first, lane_count},
                  .tile_kind = tile_kind,
                  .segment = segment,
                  .first_in_segment = first_in_segment});
}

void LaneArrays::Silence(LaneRange range) noexcept {
  for (LaneArray<double>* state : {&re, &im}) {
    std::fill_n(state->data() + range.first, range.count, 0.0);
  }
}

}  // namespace carillon
