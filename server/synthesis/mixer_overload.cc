// SPDX-License-Identifier: Apache-2.0
// The mixer's decisions under overload: which impulses are merged or shed, and which banks are
// silenced, so that each block is rendered in time. Like Mixer::Render, nothing here allocates,
// locks, logs, throws or calls the system.
#include <algorithm>
#include <cmath>
#include <utility>

#include "server/synthesis/mixer.h"

namespace carillon {
namespace {

/// An impulse 6 dB quieter than all that the last block rendered is shed on arrival, if it is due
/// within this number of blocks.
constexpr float kEarlyShedRatio = 0.5F;
constexpr uint64_t kEarlyShedBlocks = 8;

/// Part of the bound that ringing banks may take; impulses get the rest.
constexpr double kRingingShare = 0.9;
/// Part of the bound that impulses may take in any case, so that moves and forces, however many, do
/// not silence them.
constexpr double kStrikingShare = 0.2;

}  // namespace

/// Whether an impulse is so quiet that keeping and judging it would be a waste: see
/// kEarlyShedRatio.
bool Mixer::IsShedEarly(const MixerEvent& event, const BankSlot& slot) const noexcept {
  return early_shed_below_ > 0 && event.impulse() != nullptr &&
         event.FirstSample() < block_start_ + kEarlyShedBlocks * settings_.block_frame_count &&
         LoudnessOf(*event.impulse(), slot) < early_shed_below_;
}

/// Decides which impulses of a block are exact, merged or shed.
void Mixer::DecideTreatment(std::span<const uint32_t> due) noexcept {
  triage_.Clear();
  for (const uint32_t index : due) {
    const MixerEvent& event = pending_[index];
    BankSlot* slot = FindSlot(event.bank);
    if (slot == nullptr || event.impulse() == nullptr) continue;
    if (WasStopped(event, *slot, pending_.tag(index))) continue;
    const double awakening = slot->awakening ? 0 : slot->bank->awakening_work();
    slot->awakening = true;
    triage_.Note(LoudnessOf(*event.impulse(), *slot), slot->bank->strike_work() + awakening,
                 slot->bank->merged_strike_work() + awakening);
  }
  for (const uint32_t index : due) {
    if (BankSlot* slot = FindSlot(pending_[index].bank)) slot->awakening = false;
  }
  const double taken = work::kTakeEvent * static_cast<double>(std::exchange(taken_count_, 0));
  const double judged = work::kChooseEvent * static_cast<double>(due.size());
  const double spent = ringing_work_ + taken + judged;
  const double most_work = budget_.most_work();
  rendered_work_ += spent + triage_.Decide(std::max(most_work - spent, kStrikingShare * most_work));
  early_shed_below_ = triage_.shed_below() * kEarlyShedRatio;
}

float Mixer::LoudnessOf(const SurfaceImpulse& impulse, const BankSlot& slot) const noexcept {
  const auto& [x, y, z] = impulse.impulse_newton_seconds;
  const float squared = x * x + y * y + z * z;
  return buses_[slot.bus]->fader.target() * slot.loudness_per_newton_second * std::sqrt(squared);
}

double Mixer::LoudestSquared(uint32_t slot) const noexcept {
  const double gain = buses_[slots_[slot].bus]->fader.target();
  return gain * gain * slots_[slot].bank->loudest_squared();
}

/// Silences the quietest banks until the rest can be rendered in time. Returns their number.
uint64_t Mixer::ShedBanks() noexcept {
  triage_.Clear();
  for (const uint32_t section : open_sections_) {
    for (const uint32_t index : sections_[section]->section.sounding()) {
      const OscillatorBank& bank = *slots_[index].bank;
      triage_.Note(static_cast<float>(LoudestSquared(index)), bank.ringing_work(),
                   bank.ringing_work());
    }
  }
  ringing_work_ = triage_.Decide(kRingingShare * budget_.most_work());
  uint64_t shed_count = 0;
  for (const uint32_t section : open_sections_) {
    for (const uint32_t index : sections_[section]->section.sounding()) {
      if (triage_.Treat(static_cast<float>(LoudestSquared(index))) != Treatment::kShed) continue;
      slots_[index].bank->Shed();
      ++shed_count;
    }
  }
  return shed_count;
}

}  // namespace carillon
