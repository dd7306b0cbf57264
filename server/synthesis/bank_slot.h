// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "server/synthesis/bank/oscillator_bank.h"
#include "server/synthesis/voice/voice.h"

namespace carillon {

/// A bank as the rendering threads see it.
struct BankSlot {
  OscillatorBank* bank = nullptr;
  Voice* voice = nullptr;  ///< null if the bank is heard without a position
  uint32_t generation = 0;
  uint32_t section = 0;  ///< the section that renders it
  uint32_t bus = 0;      ///< of that section
  float loudness_per_newton_second = 0;
  uint32_t pending_count = 0;  ///< events that wait for their block
  bool sounding = false;       ///< among the sounding banks of its section
  bool rendered = false;       ///< already in this block
  bool leaving = false;        ///< retired once it is silent
  bool fading = false;
  bool awakening = false;  ///< its awakening_work is counted already in the present block
  float fade_gain = 1;
};

}  // namespace carillon
