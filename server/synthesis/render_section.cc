// SPDX-License-Identifier: Apache-2.0
#include "server/synthesis/render_section.h"

#include <algorithm>
#include <array>
#include <utility>

#include "server/synthesis/schedule/work_budget.h"

namespace carillon {
namespace {

/// How many of the strikes, from the first on, sound as one.
size_t CountTogether(std::span<const DueStrike> strikes) {
  const DueStrike& first = strikes.front();
  if (!first.merged) return 1;
  const auto other = std::ranges::find_if(strikes, [&first](const DueStrike& strike) {
    return !strike.merged || strike.slot != first.slot ||
           strike.offset / kMergedFrames != first.offset / kMergedFrames;
  });
  return static_cast<size_t>(other - strikes.begin());
}

/// Of the first strike's bank.
size_t CountImpulses(std::span<const DueStrike> strikes) {
  const uint32_t slot = strikes.front().slot;
  size_t count = 0;
  while (!strikes.empty() && strikes.front().slot == slot) {
    if (strikes.front().strike->kind == StrikeKind::kImpulse) ++count;
    strikes = strikes.subspan(CountTogether(strikes));
  }
  return count;
}

}  // namespace

RenderSection::RenderSection(const Settings& settings, std::span<BankSlot> slots)
    : settings_(settings),
      slots_(slots),
      sounding_(settings.most_banks),
      voices_(settings.most_banks),
      mix_(settings.block_frame_count, settings.stagger) {}

SectionCounts RenderSection::Render(uint64_t block_number, std::span<const DueStrike> strikes,
                                    const Output& output, RenderDesk& desk) noexcept {
  SectionCounts counts;
  const size_t placed_count = settings_.block_frame_count * settings_.channel_count;
  std::span<float> frames = output.frames;
  for (uint32_t i = 0; !frames.empty(); ++i) {
    const std::span<float> block = frames.first(settings_.block_frame_count);
    frames = frames.subspan(block.size());
    if (sounding_.empty() && voices_.empty() && mix_.idle() &&
        (strikes.empty() || strikes.front().block > i)) {
      std::ranges::fill(block, 0.0F);
      continue;
    }
    mix_.Begin(block_number + i, desk);
    const auto later = std::ranges::find_if(strikes, [i](const auto& s) { return s.block > i; });
    const auto due_count = static_cast<size_t>(later - strikes.begin());
    Strike(strikes.first(due_count), counts);
    strikes = strikes.subspan(due_count);
    for (const uint32_t index : sounding_) RenderBank(slots_[index], counts);
    mix_.Finish(block);
    FinishBanks(block, counts);
    if (voices_.empty()) continue;
    if (!std::exchange(counts.placed, true)) std::ranges::fill(output.placed, 0.0F);
    RenderVoices(output.placed.subspan(i * placed_count, placed_count), counts);
  }
  return counts;
}

void RenderSection::Strike(std::span<const DueStrike> strikes, SectionCounts& counts) noexcept {
  for (bool same_bank = false; !strikes.empty();) {
    if (!same_bank) mix_.batch().due_count = CountImpulses(strikes);
    const size_t count = CountTogether(strikes);
    const std::span<const DueStrike> due = strikes.first(count);
    strikes = strikes.subspan(count);
    const uint32_t index = due.front().slot;
    BankSlot& slot = slots_[index];
    same_bank = !strikes.empty() && strikes.front().slot == index;
    mix_.batch().ahead = {};
    if (!strikes.empty()) {
      const std::span<const DueStrike> next = strikes.first(CountTogether(strikes));
      mix_.batch().ahead = slots_[next.front().slot].bank->RowsOf(next);
    }
    if (slot.voice != nullptr) mix_.SetApart(settings_.block_frame_count);
    const bool struck = !slot.fading && Excite(slot, due);
    if (!struck) counts.dropped_count += count;
    const StrikeKind kind = due.front().strike->kind;
    // Nothing rings before the knot.
    if (struck && !slot.sounding && (kind == StrikeKind::kImpulse || kind == StrikeKind::kKnot)) {
      slot.sounding = true;
      sounding_.push_back(index);
    }
    if (!same_bank && slot.sounding) RenderBank(slot, counts);
    if (!same_bank) mix_.Reunite();
  }
}

bool RenderSection::Excite(BankSlot& slot, std::span<const DueStrike> due) noexcept {
  const PendingStrike& strike = *due.front().strike;
  OscillatorBank& bank = *slot.bank;
  if (due.front().merged) return bank.StrikeMerged(due, mix_);
  switch (strike.kind) {
    case StrikeKind::kForce:
      return bank.Gather(strike.excitation);
    case StrikeKind::kKnot:
      return bank.Tie(strike.knot, due.front().offset, mix_);
    case StrikeKind::kMove:
    case StrikeKind::kMoveListener:
      return Move(slot.voice, strike, due.front().offset);
    default:
      return bank.Strike(strike.excitation, due.front().offset, strike.lead_frames, mix_);
  }
}

void RenderSection::RenderBank(BankSlot& slot, SectionCounts& counts) noexcept {
  if (slot.rendered || (slot.fading && slot.bank->out_of_spectrum())) return;
  slot.rendered = true;
  if (slot.voice != nullptr) mix_.SetApart(settings_.block_frame_count);
  if (!slot.bank->RenderAdd(mix_)) ++counts.reset_bank_count;
  if (slot.voice == nullptr) return;
  Awake(*slot.voice);
  mix_.TakeApart(slot.voice->input());
  mix_.Reunite();
}

bool RenderSection::Move(Voice* voice, const PendingStrike& strike, size_t offset) noexcept {
  if (voice == nullptr) return false;
  Awake(*voice);
  if (strike.kind == StrikeKind::kMove) {
    voice->Move(ToMotion(strike.excitation), offset);
  } else {
    voice->MoveListener(ToMotion(strike.excitation), offset);
  }
  return true;
}

void RenderSection::Awake(Voice& voice) noexcept {
  if (!voice.asleep()) return;
  voice.Awake();
  voices_.push_back(&voice);
}

void RenderSection::RenderVoices(std::span<float> placed, SectionCounts& counts) noexcept {
  counts.ringing_work += work::kVoice * static_cast<double>(voices_.size());
  voices_.EraseIf([placed](Voice* voice) {
    voice->Render(placed);
    return voice->asleep();
  });
}

void RenderSection::RenderFading(BankSlot& slot, std::span<float> block,
                                 SectionCounts& counts) noexcept {
  std::array<float, kMostBlockFrames> faded{};
  mix_.SetApart(block.size());
  if (!slot.bank->RenderAddInTime(mix_.lanes())) ++counts.reset_bank_count;
  mix_.TakeApart(std::span(faded).first(block.size()));
  mix_.Reunite();
  for (size_t n = 0; n < block.size(); ++n) {
    slot.fade_gain = std::max(slot.fade_gain - settings_.fade_step, 0.0F);
    block[n] += slot.fade_gain * faded[n];
  }
}

/// Fades those that fade, counts, and dismisses the silent.
void RenderSection::FinishBanks(std::span<float> block, SectionCounts& counts) noexcept {
  counts.active_mode_count = 0;
  counts.ringing_work = 0;
  sounding_.EraseIf([&](uint32_t index) ABSL_EXCLUSIVE_LOCKS_REQUIRED(kRenderRole) {
    BankSlot& slot = slots_[index];
    if (!slot.rendered) {
      if (slot.voice != nullptr) Awake(*slot.voice);
      RenderFading(slot, slot.voice != nullptr ? slot.voice->input() : block, counts);
    }
    slot.rendered = false;
    counts.active_mode_count += slot.bank->active_mode_count();
    counts.ringing_work += slot.bank->ringing_work();
    slot.sounding = !slot.bank->silent() && slot.fade_gain > 0;
    return !slot.sounding;
  });
}

}  // namespace carillon
