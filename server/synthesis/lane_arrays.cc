// SPDX-License-Identifier: Apache-2.0
#include "server/synthesis/lane_arrays.h"

#include <algorithm>

namespace carillon {

LaneArrays::LaneArrays(size_t lane_count)
    : powers(lane_count * 2 * kTileFrames),
      block_re(lane_count),
      block_im(lane_count),
      re(lane_count),
      im(lane_count),
      start_re(lane_count),
      start_im(lane_count),
      newborn_re(lane_count),
      newborn_im(lane_count),
      gain_re(lane_count),
      gain_im(lane_count),
      lead_re(lane_count),
      lead_im(lane_count),
      tau_re(lane_count),
      tau_im(lane_count),
      column(lane_count) {}

void LaneArrays::Silence(LaneRange range) noexcept {
  for (LaneArray<double>* state : {&re, &im}) {
    std::fill_n(state->data() + range.first, range.count, 0.0);
  }
}

}  // namespace carillon
