// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

#include "server/synthesis/spectrum/spectral_lanes.h"

namespace carillon::spectral_kernel {

/// Result of Spread.
struct Spreading {
  bool awake = false;          ///< any lane still rings
  bool fell_asleep = false;    ///< some lanes were put to sleep
  double loudest_squared = 0;  ///< largest squared amplitude
  bool finite = true;
};

/// Adds the first `mode_count` lanes to the slots of a spectrum and advances them by a long block.
/// Groups of kMostLanes lanes whose squared amplitudes are all below `silence_squared` are put to
/// sleep and not added. Compiled for every SIMD target and dispatched at run time; neither
/// allocates, locks nor throws.
Spreading Spread(SpectralLanes& lanes, size_t mode_count, double silence_squared,
                 float* slots) noexcept;

}  // namespace carillon::spectral_kernel
