// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "server/synthesis/schedule/mixer_event.h"

namespace carillon {

/// An event and its place among the blocks that are rendered together. The frame of a contact is
/// decided in server/scene/time_mapping.h.
struct DueEvent {
  uint32_t slot = 0;    ///< the bank's
  uint32_t block = 0;   ///< index among the blocks rendered together
  uint32_t offset = 0;  ///< first audible sample, frames since that block's start
  bool merged = false;  ///< an impulse that is merged with its neighbours in time
  const MixerEvent* event = nullptr;
};

/// Merged impulses that fall into the same group of this number of frames sound as one.
inline constexpr uint32_t kMergedFrames = 4;

}  // namespace carillon
