// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "server/synthesis/bank/oscillator_bank.h"
#include "server/synthesis/schedule/mixer_event.h"
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

/// The slots of all banks of a mixer. Its size is fixed.
class BankTable {
 public:
  explicit BankTable(size_t slot_count) : slots_(slot_count) {}

  std::span<BankSlot> slots() noexcept { return slots_; }
  BankSlot& operator[](size_t index) noexcept { return slots_[index]; }

  /// Returns the slot of a bank, or null if the bank is not on the mixer.
  BankSlot* Find(BankId id) noexcept {
    if (id.slot >= slots_.size()) return nullptr;
    BankSlot& slot = slots_[id.slot];
    return slot.bank != nullptr && slot.generation == id.generation ? &slot : nullptr;
  }

 private:
  std::vector<BankSlot> slots_;
};

}  // namespace carillon
