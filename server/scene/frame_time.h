// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstdint>

#include "server/synthesis/strike.h"

namespace carillon {

/// Sets the time of `strike`: `frames`, zero or more, since the mixer began.
inline void SetFrame(Strike& strike, double frames) {
  const double whole = std::floor(frames);
  strike.frame = static_cast<uint64_t>(whole);
  // The cast may round 1 - 1e-9 up to 1.
  strike.fraction = std::fmin(static_cast<float>(frames - whole), 0x1.fffffep-1F);
}

}  // namespace carillon
