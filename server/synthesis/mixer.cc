// SPDX-License-Identifier: Apache-2.0
// The rendering thread's side of the mixer: nothing here allocates, locks, logs, throws or calls
// the system. The vectors never grow beyond what was reserved when the mixer was made.
#include "server/synthesis/mixer.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <utility>

#include "server/synthesis/flush_denormals.h"
#include "server/synthesis/frames.h"

namespace carillon {
namespace {

/// Adds to a counter that only this thread writes.
void Count(std::atomic<uint64_t>& counter, uint64_t more = 1) noexcept {
  counter.store(counter.load(std::memory_order_relaxed) + more, std::memory_order_relaxed);
}

static_assert(kMostBuses * kSectionCount <= RenderOrder::kMostSections);
static_assert(kBlocksTogether <= RenderOrder::kMostBlocks);
static_assert(kMostBlockFrames <= RenderOrder::kMostGroups * kMergedFrames);

}  // namespace

void Mixer::Render(std::span<float> frames) noexcept {
  const size_t block_size = settings_.block_frame_count * settings_.channel_count;
  assert(frames.size() % block_size == 0);
  const InRole role(kRenderRole);
  const FlushDenormals flush_denormals;
  while (!frames.empty()) {
    const size_t count = std::min(frames.size(), kBlocksTogether * block_size);
    RenderBlocks(frames.first(count));
    frames = frames.subspan(count);
  }
}

void Mixer::RenderBlocks(std::span<float> frames) noexcept {
  const size_t frame_count = frames.size() / settings_.channel_count;
  const size_t block_count = frame_count / settings_.block_frame_count;
  budget_.Begin();
  ExecuteCommands();
  ListenToControl();
  TakeEvents(block_count);
  CollectDueEvents(block_count);
  RenderSections(frame_count);
  MixBuses(frames);
  EndStops();
  pending_.Free(due_);
  RetireLeavingBanks();
  resting_.store(NothingWaits(), std::memory_order_relaxed);
  NotePeak(frames);
  Count(statistics_.limited_frame_count, limiter_.Apply(frames));
  block_start_ += frame_count;
  statistics_.frame_count.store(block_start_, std::memory_order_release);
  budget_.End(rendered_work_, static_cast<double>(block_count));
}

void Mixer::ExecuteCommands() noexcept {
  for (Command command; commands_.TryPop(command);) Execute(command);
}

void Mixer::Execute(const Command& command) noexcept {
  if (command.kind == Command::Kind::kAddStream) {
    open_queues_.push_back(command.queue);
  } else if (command.kind == Command::Kind::kAddBank) {
    if (command.opened != nullptr) OpenSection(command.section, command.opened);
    slots_[command.id.slot] = {
        .bank = command.bank,
        .voice = command.voice,
        .generation = command.id.generation,
        .section = command.section,
        .bus = static_cast<uint32_t>(command.section / kSectionCount),
        .loudness_per_newton_second = command.bank->loudness_per_newton_second()};
    Count(statistics_.bank_count);
    if (command.voice == nullptr) return;
    ++command.voice->bank_count;
    // A voice is fed in the time domain.
    command.bank->LeaveSpectrum();
    if (const DirectedGains* gains = command.bank->gains()) {
      command.voice->SetCenter(gains->center_m());
    }
  } else if (BankSlot* slot = FindSlot(command.id)) {  // null: it rang out before it was to fade
    if (!slot->leaving) leaving_.push_back(command.id.slot);
    slot->leaving = true;
    if (command.kind != Command::Kind::kFadeOut) return;
    slot->fading = true;
    slot->bank->LeaveSpectrum();
  }
}

BankSlot* Mixer::FindSlot(BankId id) noexcept {
  if (id.slot >= slots_.size()) return nullptr;
  BankSlot& slot = slots_[id.slot];
  return slot.bank != nullptr && slot.generation == id.generation ? &slot : nullptr;
}

void Mixer::TakeEvents(size_t block_count) noexcept {
  // Each stream may first hand over an equal share, so that a flood in one stream does not hold up
  // the rest, and each block begins with another stream.
  const size_t count = open_queues_.size();
  const size_t first = count == 0 ? 0 : block_start_ / settings_.block_frame_count % count;
  size_t budget = settings_.most_events_per_block * block_count;
  all_events_taken_ = true;
  for (const size_t share : {budget / std::max<size_t>(count, 1), budget}) {
    for (size_t i = 0; i < count; ++i) {
      budget -= TakeSome(*open_queues_[(first + i) % count], std::min(share, budget));
    }
  }
  if (budget == 0) all_events_taken_ = false;
  // The order of these two reads matters: a queue that is closed first and then empty stays empty.
  open_queues_.EraseIf([this](EventQueue* queue) ABSL_EXCLUSIVE_LOCKS_REQUIRED(kRenderRole) {
    const bool done = queue->closed.load(std::memory_order_acquire) && queue->events.empty();
    if (done) SendBack({.queue = queue});
    return done;
  });
}

/// Takes up to `most` events from a queue, and returns their number.
size_t Mixer::TakeSome(EventQueue& queue, size_t most) noexcept {
  size_t count = 0;
  while (count < most) {
    const size_t wanted = std::min(most - count, taken_.size());
    const size_t popped = queue.events.PopSome(taken_.data(), wanted);
    for (size_t k = 0; k < popped; ++k) Take(taken_[k], queue);
    count += popped;
    if (popped < wanted) break;
  }
  taken_count_ += count;
  return count;
}

void Mixer::Take(MixerEvent& event, EventQueue& queue) noexcept {
  // A bank may have been added, and have got events, since this block's commands were executed.
  if (FindSlot(event.bank) == nullptr) {
    ExecuteCommands();
    all_events_taken_ = false;
  }
  BankSlot* slot = FindSlot(event.bank);
  const bool late = event.FirstSample() < block_start_;
  if (late) {
    event.frame = block_start_;
    event.fraction = 0;
  }
  const bool known = slot != nullptr && !slot->fading;
  const bool shed_early = known && IsShedEarly(event, *slot);
  if (!known || (!shed_early && !Await(event, *slot))) {
    Count(queue.dropped_count, event.ReportCount());
    return Count(statistics_.dropped_count, event.ReportCount());
  }
  Count(statistics_.shed_count, shed_early ? event.ReportCount() : 0);
  if (event.impulse() == nullptr) return;
  const bool counts_as_late = late && queue.kind == StreamKind::kTimely;
  Count(counts_as_late ? queue.late_count : queue.accepted_count, event.ReportCount());
  Count(counts_as_late ? statistics_.late_count : statistics_.accepted_count, event.ReportCount());
}

/// Keeps an event until its block, and the start of its contact if the bank sounds from then on.
/// False: there are too many, in all or in its block, or too many on its bus.
bool Mixer::Await(MixerEvent& event, BankSlot& slot) noexcept {
  const SurfaceImpulse* impulse = event.impulse();
  const double lead = impulse != nullptr ? slot.bank->ContactLeadFrames(impulse->pulse) : 0;
  const auto now = static_cast<double>(block_start_);
  // A contact that would have begun already begins now.
  if (lead > 0 && event.Time() - lead < now) event.SetTime(now + lead);
  const auto push = [&](const MixerEvent& awaited) ABSL_EXCLUSIVE_LOCKS_REQUIRED(kRenderRole) {
    const bool pushed = pending_.TryPush(awaited, buses_[slot.bus]->stop_count, slot.bus);
    if (pushed) ++slot.pending_count;
    return pushed;
  };
  if (!push(event)) return false;
  if (!(lead > 0)) return true;
  MixerEvent begin = event;
  begin.action = ContactBegin{*impulse};
  begin.added_count = 0;
  begin.SetTime(std::max(event.Time() - lead, now));
  // The impulse sounds without its beginning if there is no place for that.
  if (!push(begin)) Count(statistics_.dropped_count);
  return true;
}

void Mixer::CollectDueEvents(size_t block_count) noexcept {
  due_.clear();
  due_order_.clear();
  due_events_.clear();
  rendered_work_ = 0;
  for (const uint32_t section : open_sections_) sections_[section]->due = {};
  if (budget_.bounded() && ringing_work_ > budget_.most_work()) {
    Count(statistics_.shed_bank_count, ShedBanks());
  }
  for (uint32_t block = 0; block < block_count; ++block) {
    const size_t first = due_.size();
    const auto is_stale = [this](const MixerEvent& event, uint32_t stop_count) {
      const InRole role(kRenderRole);
      return IsStale(event, stop_count);
    };
    pending_.Collect(block_start_ + block * settings_.block_frame_count, due_, is_stale);
    const std::span<const uint32_t> due = std::span(due_).subspan(first);
    if (budget_.bounded()) DecideTreatment(due);
    ChooseEvents(block, due);
  }
  std::ranges::sort(due_order_);
  for (const RenderOrder& order : due_order_) {
    const RenderOrder::Fields due = order.fields();
    due_events_.push_back({.slot = due.slot,
                           .block = due.block,
                           .offset = due.offset,
                           .merged = due.merged,
                           .event = &pending_[due_[due.arrival]]});
    std::span<const DueEvent>& section = sections_[due.section]->due;
    section = std::span(due_events_).last(section.size() + 1);
  }
}

/// Whether a bus that was stopped after the event came leaves it out: an impulse, or its beginning.
bool Mixer::WasStopped(const MixerEvent& event, const BankSlot& slot,
                       uint32_t stop_count) const noexcept {
  const bool strikes = event.impulse() != nullptr || event.beginning() != nullptr;
  return strikes && stop_count != buses_[slot.bus]->stop_count;
}

/// Whether an event will have no effect, because its bank has gone or its bus was stopped. Such an
/// event gives its place to others before it is due.
bool Mixer::IsStale(const MixerEvent& event, uint32_t stop_count) noexcept {
  const BankSlot* slot = FindSlot(event.bank);
  return slot == nullptr || WasStopped(event, *slot, stop_count);
}

/// Decides which of a block's events are rendered, and notes their places in the order of
/// rendering.
void Mixer::ChooseEvents(uint32_t block, std::span<const uint32_t> due) noexcept {
  const uint64_t start = block_start_ + block * settings_.block_frame_count;
  auto next_arrival = static_cast<uint32_t>(due.data() - due_.data());
  for (const uint32_t index : due) {
    const MixerEvent& event = pending_[index];
    const uint32_t arrival = next_arrival++;
    BankSlot* slot = FindSlot(event.bank);
    if (slot == nullptr) {
      Count(statistics_.dropped_count, event.ReportCount());
      continue;
    }
    --slot->pending_count;
    const bool strikes = event.impulse() != nullptr;
    const SurfaceImpulse* impulse = strikes ? event.impulse() : event.beginning();
    if (WasStopped(event, *slot, pending_.tag(index))) continue;
    Treatment treatment = Treatment::kExact;
    if (budget_.bounded() && impulse != nullptr) {
      treatment = triage_.Treat(LoudnessOf(*impulse, *slot));
    }
    if (treatment == Treatment::kShed) {
      Count(statistics_.shed_count, strikes ? event.ReportCount() : 0);
      continue;
    }
    const bool merged = strikes && treatment == Treatment::kMerged;
    Count(statistics_.merged_count, merged ? event.ReportCount() : 0);
    due_order_.push_back(RenderOrder({.section = slot->section,
                                      .block = block,
                                      .slot = event.bank.slot,
                                      .offset = static_cast<uint32_t>(event.FirstSample() - start),
                                      .merged = merged,
                                      .arrival = arrival}));
  }
}

void Mixer::RenderOneSection(size_t thread, MixedSection& mixed, size_t frame_count) noexcept {
  mixed.counts = mixed.section.Render(
      block_start_ / settings_.block_frame_count, mixed.due,
      {.frames = std::span(mixed.frames).first(frame_count),
       .placed = std::span(mixed.placed).first(frame_count * settings_.channel_count)},
      workspaces_[thread]);
}

void Mixer::RenderSections(size_t frame_count) noexcept {
  const auto render = [&](size_t thread, size_t index) {
    const InRole role(kRenderRole);  // each of the threads that render sections has it
    RenderOneSection(thread, *sections_[open_sections_[index]], frame_count);
  };
  if (settings_.threads != nullptr) {
    settings_.threads->Render(open_sections_.size(), render);
  } else {
    for (const uint32_t section : open_sections_) {
      RenderOneSection(0, *sections_[section], frame_count);
    }
  }
}

void Mixer::RetireLeavingBanks() noexcept {
  leaving_.EraseIf([this](uint32_t index) ABSL_EXCLUSIVE_LOCKS_REQUIRED(kRenderRole) {
    BankSlot& slot = slots_[index];
    const bool awaited = !slot.fading && (slot.pending_count > 0 || !all_events_taken_);
    // The last bank of a voice stays until the voice has delivered all of its delayed sound.
    const bool last_of_voice = slot.voice != nullptr && slot.voice->bank_count == 1;
    if (slot.sounding || awaited || (last_of_voice && !slot.voice->asleep())) return false;
    if (slot.voice != nullptr) --slot.voice->bank_count;
    SendBack({.id = {.slot = index, .generation = slot.generation}});
    slot.bank = nullptr;
    slot.voice = nullptr;
    statistics_.bank_count.fetch_sub(1, std::memory_order_relaxed);
    return true;
  });
}

void Mixer::SendBack(const Retired& retired) noexcept {
  // There is room for every bank and stream.
  [[maybe_unused]] const bool sent = retired_.TryPush(retired);
  assert(sent);
}

bool Mixer::NothingWaits() const noexcept {
  const auto sounds = [this](uint32_t section) ABSL_EXCLUSIVE_LOCKS_REQUIRED(kRenderRole) {
    return sections_[section]->counts.sounded;
  };
  const auto carries_contacts = [](const EventQueue* queue) {
    return queue->kind != StreamKind::kMoves;
  };
  return pending_.empty() && std::ranges::none_of(open_sections_, sounds) &&
         std::ranges::none_of(open_queues_, carries_contacts);
}

void Mixer::NotePeak(std::span<const float> block) noexcept {
  const float peak = LargestMagnitude(block);
  float noted = peak_.load(std::memory_order_relaxed);
  while (peak > noted && !peak_.compare_exchange_weak(noted, peak, std::memory_order_relaxed)) {
  }
}

}  // namespace carillon
