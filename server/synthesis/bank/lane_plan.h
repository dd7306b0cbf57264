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

/// One lane of a bank: a mode, a multiplet or the companion of a mode.
struct PlannedLane {
  uint32_t column = 0;
  uint32_t multiplet = 0;      ///< see SoundingMode; `column` is then that of its first mode
  uint32_t mode_count = 1;     ///< number of modes that sound by the lane; zero for a companion
  std::complex<double> log_q;  ///< (sigma + i omega)/rate
  /// The state after a modal impulse of one unit of the shape table or, for a multiplet, of one.
  std::complex<double> start;
  std::complex<double> contact_s;  ///< sigma + i omega, 1/s, for the factor of a contact
  SpreadMode spread;               ///< how the lane spreads in the long blocks of its part
  bool companion = false;
};

/// The lanes of a bank in parts. Part 0 stays in the time domain and is sorted by descending decay
/// time. Part 1 + k rings by spectrum in long blocks of kind k and is sorted by ascending slot.
struct LanePlan {
  std::array<std::vector<PlannedLane>, 1 + kLongBlockKinds> lanes;

  /// Number of lanes of a part, padded to whole vectors.
  size_t PaddedCount(size_t part) const {
    return (lanes[part].size() + kMostLanes - 1) / kMostLanes * kMostLanes;
  }

  /// Number of lanes of all padded parts.
  size_t PaddedCount() const {
    size_t count = 0;
    for (size_t part = 0; part < lanes.size(); ++part) count += PaddedCount(part);
    return count;
  }

  /// Returns the lanes of a padded part that are rendered in tiles of this kind. The slower a mode
  /// oscillates, the longer are its tiles. Part 0 always uses the shortest tiles.
  LaneRange Tiled(size_t part, size_t tile_kind) const;
};

/// The mixer that a bank is planned for, and the bank's gain.
struct LanePlanSettings {
  double sample_rate_hz = 0;
  size_t block_frame_count = 0;
  double gain = 1;
  bool directed = false;  ///< every mode has a companion, because its gain may have any phase
};

LanePlan PlanLanes(const SoundingModes& sounding, const ShapeTable& shapes,
                   const LanePlanSettings& settings);

}  // namespace carillon
