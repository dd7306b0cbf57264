// SPDX-License-Identifier: Apache-2.0
#include "server/synthesis/render_section.h"

#include <algorithm>
#include <array>
#include <utility>
#include <variant>

#include "server/synthesis/schedule/work_budget.h"

namespace carillon {
namespace {

/// Returns the number of leading events that are rendered as one.
size_t CountTogether(std::span<const DueEvent> events) {
  const DueEvent& first = events.front();
  if (!first.merged) return 1;
  const auto other = std::ranges::find_if(events, [&first](const DueEvent& due) {
    return !due.merged || due.slot != first.slot ||
           due.offset / kMergedFrames != first.offset / kMergedFrames;
  });
  return static_cast<size_t>(other - events.begin());
}

/// Returns the number of impulses of the first event's bank; impulses merged into one count once.
size_t CountImpulses(std::span<const DueEvent> events) {
  const uint32_t slot = events.front().slot;
  size_t count = 0;
  while (!events.empty() && events.front().slot == slot) {
    if (events.front().event->impulse() != nullptr) ++count;
    events = events.subspan(CountTogether(events));
  }
  return count;
}

/// Whether the event can make a silent bank sound. A force takes effect at its knot.
bool CanAwaken(const MixerEvent& event) {
  return event.impulse() != nullptr || event.beginning() != nullptr ||
         std::holds_alternative<ForceKnot>(event.action);
}

}  // namespace

RenderSection::RenderSection(const Settings& settings, std::span<BankSlot> slots)
    : settings_(settings),
      slots_(slots),
      sounding_(settings.most_banks),
      voices_(settings.most_banks),
      mix_(settings.block_frame_count, settings.stagger) {}

SectionCounts RenderSection::Render(uint64_t block_number, std::span<const DueEvent> events,
                                    const Output& output, RenderWorkspace& workspace) noexcept {
  SectionCounts counts;
  counts.sounded = !idle() || !events.empty();
  if (!counts.sounded) return counts;
  const size_t placed_count = settings_.block_frame_count * settings_.channel_count;
  std::span<float> frames = output.frames;
  for (uint32_t i = 0; !frames.empty(); ++i) {
    const std::span<float> block = frames.first(settings_.block_frame_count);
    frames = frames.subspan(block.size());
    if (idle() && (events.empty() || events.front().block > i)) {
      std::ranges::fill(block, 0.0F);
      continue;
    }
    mix_.Begin(block_number + i, workspace);
    const auto later = std::ranges::find_if(events, [i](const auto& due) { return due.block > i; });
    const auto due_count = static_cast<size_t>(later - events.begin());
    Execute(events.first(due_count), counts);
    events = events.subspan(due_count);
    for (const uint32_t index : sounding_) RenderBank(slots_[index], counts);
    mix_.Finish(block);
    FinishBanks(block, counts);
    if (voices_.empty()) continue;
    if (!std::exchange(counts.placed, true)) std::ranges::fill(output.placed, 0.0F);
    RenderVoices(output.placed.subspan(i * placed_count, placed_count), counts);
  }
  return counts;
}

void RenderSection::Execute(std::span<const DueEvent> events, SectionCounts& counts) noexcept {
  for (bool same_bank = false; !events.empty();) {
    if (!same_bank) mix_.batch().due_count = CountImpulses(events);
    const size_t count = CountTogether(events);
    const std::span<const DueEvent> due = events.first(count);
    events = events.subspan(count);
    const uint32_t index = due.front().slot;
    BankSlot& slot = slots_[index];
    same_bank = !events.empty() && events.front().slot == index;
    mix_.batch().ahead = {};
    if (!events.empty()) {
      const std::span<const DueEvent> next = events.first(CountTogether(events));
      mix_.batch().ahead = slots_[next.front().slot].bank->RowsOf(next);
    }
    if (slot.voice != nullptr) mix_.SetApart(settings_.block_frame_count);
    const bool applied = !slot.fading && Apply(slot, due);
    for (const DueEvent& lost : applied ? due.first(0) : due) {
      counts.dropped_count += lost.event->ReportCount();
    }
    if (applied && !slot.sounding && CanAwaken(*due.front().event)) {
      slot.sounding = true;
      sounding_.push_back(index);
    }
    if (!same_bank && slot.sounding) RenderBank(slot, counts);
    if (!same_bank) mix_.Reunite();
  }
}

void RenderSection::Silence() noexcept {
  mix_.Silence();
  for (const uint32_t index : sounding_) slots_[index].bank->Hush();
  for (Voice* voice : voices_) voice->Silence();
}

bool RenderSection::Apply(BankSlot& slot, std::span<const DueEvent> due) noexcept {
  const DueEvent& first = due.front();
  const MixerEvent& event = *first.event;
  OscillatorBank& bank = *slot.bank;
  if (CanAwaken(event)) SetGains(slot);
  if (first.merged) return bank.StrikeMerged(due, mix_);
  if (const SurfaceImpulse* impulse = event.impulse()) {
    return bank.Strike(*impulse, first.offset, event.LeadFrames(), mix_);
  }
  if (const SurfaceImpulse* impulse = event.beginning()) {
    return bank.BeginContact(*impulse, first.offset, event.LeadFrames());
  }
  if (const auto* force = std::get_if<SurfaceForce>(&event.action)) return bank.AddForce(*force);
  if (const auto* knot = std::get_if<ForceKnot>(&event.action)) {
    return bank.ApplyKnot(*knot, first.offset, mix_);
  }
  return Move(slot.voice, event, first.offset);
}

void RenderSection::RenderBank(BankSlot& slot, SectionCounts& counts) noexcept {
  if (slot.rendered || (slot.fading && slot.bank->out_of_spectrum())) return;
  slot.rendered = true;
  if (slot.voice != nullptr) mix_.SetApart(settings_.block_frame_count);
  SetGains(slot);
  if (!slot.bank->RenderAdd(mix_)) ++counts.reset_bank_count;
  if (slot.voice == nullptr) return;
  Wake(*slot.voice);
  mix_.TakeApart(slot.voice->input());
  mix_.Reunite();
}

void RenderSection::SetGains(BankSlot& slot) noexcept {
  DirectedGains* gains = slot.bank->gains();
  if (slot.voice == nullptr || gains == nullptr) return;
  gains->BeginBlock(mix_.block_number(), slot.voice->BearingOfListener());
}

bool RenderSection::Move(Voice* voice, const MixerEvent& event, size_t offset) noexcept {
  if (voice == nullptr) return false;
  Wake(*voice);
  if (const auto* object = std::get_if<ObjectMove>(&event.action)) {
    voice->Move(object->motion, offset);
  } else if (const auto* listener = std::get_if<ListenerMove>(&event.action)) {
    voice->MoveListener(listener->motion, offset);
  }
  return true;
}

void RenderSection::Wake(Voice& voice) noexcept {
  if (!voice.asleep()) return;
  voice.Wake();
  voices_.push_back(&voice);
}

void RenderSection::RenderVoices(std::span<float> placed, SectionCounts& counts) noexcept {
  voices_.EraseIf([placed, &counts](Voice* voice) {
    if (voice->sounding()) {
      counts.ringing_work += work::kVoice + (voice->binaural() ? work::kEars : 0);
    } else {
      counts.ringing_work += work::kMovingVoice;
    }
    voice->Render(placed);
    return voice->asleep();
  });
}

void RenderSection::RenderFading(BankSlot& slot, std::span<float> block,
                                 SectionCounts& counts) noexcept {
  std::array<float, kMostBlockFrames> faded{};
  mix_.SetApart(block.size());
  SetGains(slot);
  if (!slot.bank->RenderAddInTime(mix_)) ++counts.reset_bank_count;
  mix_.TakeApart(std::span(faded).first(block.size()));
  mix_.Reunite();
  for (size_t n = 0; n < block.size(); ++n) {
    slot.fade_gain = std::max(slot.fade_gain - settings_.fade_step, 0.0F);
    block[n] += slot.fade_gain * faded[n];
  }
}

/// Renders fading banks, counts modes and work, and removes silent banks from sounding_.
void RenderSection::FinishBanks(std::span<float> block, SectionCounts& counts) noexcept {
  counts.active_mode_count = 0;
  counts.ringing_work = 0;
  sounding_.EraseIf([&](uint32_t index) ABSL_EXCLUSIVE_LOCKS_REQUIRED(kRenderRole) {
    BankSlot& slot = slots_[index];
    if (!slot.rendered) {
      if (slot.voice != nullptr) Wake(*slot.voice);
      RenderFading(slot, slot.voice != nullptr ? slot.voice->input() : block, counts);
    }
    slot.rendered = false;
    if (slot.bank->BoundLoudness()) ++counts.bounded_bank_count;
    counts.active_mode_count += slot.bank->active_mode_count();
    counts.ringing_work += slot.bank->ringing_work();
    slot.sounding = !slot.bank->silent() && slot.fade_gain > 0;
    return !slot.sounding;
  });
}

}  // namespace carillon
