// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "server/synthesis/bank/oscillator_bank.h"
#include "server/synthesis/voice/voice.h"

namespace carillon {

/// A place for a bank as the rendering threads see it.
struct BankSlot {
  OscillatorBank* bank = nullptr;
  Voice* voice = nullptr;  ///< through which it is heard; null: as it is
  uint32_t generation = 0;
  uint32_t section = 0;        ///< which one renders it
  float loudness_of_blow = 0;  ///< the bank's
  uint32_t pending_count = 0;  ///< strikes that wait for their time
  bool sounding = false;       ///< is among its section's sounding banks
  bool rendered = false;       ///< in this block
  bool leaving = false;        ///< is to be retired when it is silent
  bool fading = false;
  bool awakening = false;  ///< a strike of the block being chosen for awakes the bank
  float fade_gain = 1;
};

}  // namespace carillon
