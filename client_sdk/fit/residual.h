// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "client_sdk/fit/mode_extraction.h"
#include "client_sdk/fit/recording.h"

namespace carillon::fit {

/// Part of the energy of a ring that the modes do not hold, in a span of time after the blow.
struct ResidualShare {
  double from_s, to_s;
  double share;
};

/// What a ring holds beside its modes: the contact, the hammer, the room and the noise.
struct Residual {
  std::vector<float> samples;  ///< from Ring::samples[0] on
  std::vector<ResidualShare> shares;
};

/// Takes modes from a ring, each with the amplitude, frequency and decay that it has in this ring:
/// those of `modes` are of all rings. `index` is the index of the ring among those that
/// ExtractModes had. The first 5 ms hold what the modes' extrapolation to the blow misses, too.
Residual ResidualOf(const Ring& ring, size_t index, const std::vector<MeasuredMode>& modes);

}  // namespace carillon::fit
