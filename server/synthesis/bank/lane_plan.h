// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <complex>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "server/synthesis/bank/shape_table.h"
#include "server/synthesis/bank/sounding_modes.h"
#include "server/synthesis/ringing/lane_arrays.h"
#include "server/synthesis/spectrum/long_block.h"
#include "server/synthesis/spectrum/spreading_kernel.h"

namespace carillon {

/// One lane of a bank: a mode or the companion of one.
struct PlannedLane {
  uint32_t column = 0;
  std::complex<double> log_q;  ///< (sigma + i omega)/rate
  std::complex<double> start;  ///< the state after a modal impulse of one scale of the shape table
  std::complex<double> gaussian_exponent;  ///< of the contact, for each second squared of tau^2
  SpreadMode spread;                       ///< for the kind of long block that it rings in
  bool companion = false;
};

/// The lanes of a bank by kind of long block, those first that stay in the time domain: these with
/// the longest decay first, the others ascending by slot.
struct LanePlan {
  std::array<std::vector<PlannedLane>, 1 + kLongBlockKinds> lanes;

  /// How many lanes the parts take, each padded to whole vectors.
  size_t PaddedCount(size_t part) const {
    return (lanes[part].size() + kMostLanes - 1) / kMostLanes * kMostLanes;
  }

  /// Which of a part's lanes, padded so, are rendered in tiles of this kind: those that turn
  /// fastest in the shortest. What stays in the time domain, being short, goes in those too.
  LaneRange Tiled(size_t part, size_t tile_kind) const;
};

/// How a body sounds in a mixer.
struct LanePlanSettings {
  double sample_rate_hz = 0;
  size_t block_frame_count = 0;
  double gain = 1;
};

LanePlan PlanLanes(const SoundingModes& sounding, const ShapeTable& shapes,
                   const LanePlanSettings& settings);

}  // namespace carillon
