// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "server/synthesis/schedule/pending_strikes.h"

namespace carillon {

/// A strike in its block.
struct DueStrike {
  uint32_t slot = 0;
  uint32_t block = 0;   ///< of those rendered together
  uint32_t offset = 0;  ///< frames
  bool merged = false;  ///< together with its neighbours in time, on the nearest vertex
  const PendingStrike* strike = nullptr;
};

/// Merged strikes of so many frames sound as one.
inline constexpr uint32_t kMergedFrames = 4;

}  // namespace carillon
