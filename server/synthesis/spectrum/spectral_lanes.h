// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "server/synthesis/ringing/lane_arrays.h"
#include "server/synthesis/spectrum/spreading_kernel.h"

namespace carillon {

/// Coefficients and states of a bank's modes that ring in long blocks of one kind, sorted by
/// ascending slot and padded to whole vectors.
struct SpectralLanes {
  explicit SpectralLanes(size_t lane_count)
      : weights(lane_count * 2 * kSpreadBins),
        slot(lane_count),
        block_re(lane_count),
        block_im(lane_count),
        re(lane_count),
        im(lane_count),
        awake(lane_count / kMostLanes) {}

  /// kSpreadBins complex weights for each lane, real part before imaginary part.
  LaneArray<float> weights;
  LaneArray<uint32_t> slot;
  /// q^N for a long block of N frames.
  LaneArray<double> block_re, block_im;
  /// The state at the start of the next long block.
  LaneArray<double> re, im;
  /// A flag for each group of kMostLanes lanes, which tells whether the group rings.
  std::vector<uint8_t> awake;
};

}  // namespace carillon
