// SPDX-License-Identifier: Apache-2.0
#include "server/synthesis/event_intake.h"

#include <algorithm>
#include <cmath>
#include <utility>

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

static_assert(kMostBuses * kSectionCount <= RenderOrder::kMostSections);
static_assert(kBlocksTogether <= RenderOrder::kMostBlocks);
static_assert(kMostBlockFrames <= RenderOrder::kMostGroups * kMergedFrames);

PendingEvents::BlockLimits LimitsOf(const MixerSettings& settings) {
  if (settings.clock == nullptr) return {};
  return {.impulses = kMostImpulsesPerFrame * settings.block_frame_count,
          .others = kMostOthersPerBlock};
}

}  // namespace

EventIntake::EventIntake(const MixerSettings& settings, BankTable& banks, BusMixer& buses,
                         MixerCounters& counters)
    : block_frame_count_(settings.block_frame_count),
      most_events_per_block_(settings.most_events_per_block),
      banks_(banks),
      buses_(buses),
      counters_(counters),
      open_queues_(settings.most_streams),
      pending_(settings.most_pending_events, settings.block_frame_count, settings.most_buses,
               LimitsOf(settings)),
      due_(settings.most_pending_events),
      due_order_(settings.most_pending_events),
      due_events_(settings.most_pending_events),
      budget_(settings.clock,
              static_cast<double>(settings.block_frame_count) / settings.sample_rate_hz,
              settings.most_load) {}

void EventIntake::Take(uint64_t block_start, size_t block_count,
                       absl::FunctionRef<void()> execute_commands,
                       absl::FunctionRef<void(EventQueue&)> retire) noexcept {
  block_start_ = block_start;
  // Each stream may first hand over an equal share, so that a flood in one stream does not hold up
  // the rest, and each block begins with another stream.
  const size_t count = open_queues_.size();
  const size_t first = count == 0 ? 0 : block_start_ / block_frame_count_ % count;
  size_t budget = most_events_per_block_ * block_count;
  all_taken_ = true;
  for (const size_t share : {budget / std::max<size_t>(count, 1), budget}) {
    for (size_t i = 0; i < count; ++i) {
      EventQueue& queue = *open_queues_[(first + i) % count];
      budget -= TakeSome(queue, std::min(share, budget), execute_commands);
    }
  }
  if (budget == 0) all_taken_ = false;
  // The order of these two reads matters: a queue that is closed first and then empty stays empty.
  open_queues_.EraseIf([&retire](EventQueue* queue) {
    const bool done = queue->closed.load(std::memory_order_acquire) && queue->events.empty();
    if (done) retire(*queue);
    return done;
  });
}

size_t EventIntake::TakeSome(EventQueue& queue, size_t most,
                             absl::FunctionRef<void()> execute_commands) noexcept {
  size_t count = 0;
  while (count < most) {
    const size_t wanted = std::min(most - count, taken_.size());
    const size_t popped = queue.events.PopSome(taken_.data(), wanted);
    for (size_t k = 0; k < popped; ++k) TakeOne(taken_[k], queue, execute_commands);
    count += popped;
    if (popped < wanted) break;
  }
  taken_count_ += count;
  return count;
}

void EventIntake::TakeOne(MixerEvent& event, EventQueue& queue,
                          absl::FunctionRef<void()> execute_commands) noexcept {
  BankSlot* slot = banks_.Find(event.bank);
  if (slot == nullptr) {
    execute_commands();
    all_taken_ = false;
    slot = banks_.Find(event.bank);
  }
  const bool late = event.FirstSample() < block_start_;
  if (late) {
    event.frame = block_start_;
    event.fraction = 0;
  }
  const bool known = slot != nullptr && !slot->fading;
  const bool shed_early = known && IsShedEarly(event, *slot);
  if (!known || (!shed_early && !Await(event, *slot))) {
    Count(queue.dropped_count, event.ReportCount());
    return Count(counters_.dropped_count, event.ReportCount());
  }
  Count(counters_.shed_count, shed_early ? event.ReportCount() : 0);
  if (event.impulse() == nullptr) return;
  const bool counts_as_late = late && queue.kind == StreamKind::kTimely;
  Count(counts_as_late ? queue.late_count : queue.accepted_count, event.ReportCount());
  Count(counts_as_late ? counters_.late_count : counters_.accepted_count, event.ReportCount());
}

bool EventIntake::Await(MixerEvent& event, BankSlot& slot) noexcept {
  const SurfaceImpulse* impulse = event.impulse();
  const double lead = impulse != nullptr ? slot.bank->ContactLeadFrames(impulse->pulse) : 0;
  const auto now = static_cast<double>(block_start_);
  // A contact that would have begun already begins now.
  if (lead > 0 && event.Time() - lead < now) event.SetTime(now + lead);
  if (!Keep(event, slot)) return false;
  if (!(lead > 0)) return true;
  MixerEvent begin = event;
  begin.action = ContactBegin{*impulse};
  begin.added_count = 0;
  begin.SetTime(std::max(event.Time() - lead, now));
  // The impulse sounds without its beginning if there is no place for that.
  if (!Keep(begin, slot)) Count(counters_.dropped_count);
  return true;
}

bool EventIntake::Keep(const MixerEvent& event, BankSlot& slot) noexcept {
  const bool kept = pending_.TryPush(event, buses_.bus(slot.bus).stop_count, slot.bus);
  if (kept) ++slot.pending_count;
  return kept;
}

void EventIntake::CollectDue(size_t block_count) noexcept {
  due_.clear();
  due_order_.clear();
  rendered_work_ = 0;
  ringing_work_ = buses_.ringing_work();
  if (budget_.bounded() && ringing_work_ > budget_.most_work()) {
    Count(counters_.shed_bank_count, ShedBanks());
  }
  for (uint32_t block = 0; block < block_count; ++block) {
    const size_t first = due_.size();
    const auto is_stale = [this](const MixerEvent& event, uint32_t stop_count) {
      return IsStale(event, stop_count);
    };
    pending_.Collect(block_start_ + block * block_frame_count_, due_, is_stale);
    const std::span<const uint32_t> due = std::span(due_).subspan(first);
    if (budget_.bounded()) DecideTreatment(due);
    Choose(block, due);
  }
  GiveToSections();
}

void EventIntake::GiveToSections() noexcept {
  due_events_.clear();
  for (const uint32_t section : buses_.open_sections()) buses_.section(section).due = {};
  std::ranges::sort(due_order_);
  for (const RenderOrder& order : due_order_) {
    const RenderOrder::Fields due = order.fields();
    due_events_.push_back({.slot = due.slot,
                           .block = due.block,
                           .offset = due.offset,
                           .merged = due.merged,
                           .event = &pending_[due_[due.arrival]]});
    std::span<const DueEvent>& section = buses_.section(due.section).due;
    section = std::span(due_events_).last(section.size() + 1);
  }
}

bool EventIntake::WasStopped(const MixerEvent& event, const BankSlot& slot,
                             uint32_t stop_count) const noexcept {
  const bool strikes = event.impulse() != nullptr || event.beginning() != nullptr;
  return strikes && stop_count != buses_.bus(slot.bus).stop_count;
}

bool EventIntake::IsStale(const MixerEvent& event, uint32_t stop_count) noexcept {
  const BankSlot* slot = banks_.Find(event.bank);
  return slot == nullptr || WasStopped(event, *slot, stop_count);
}

void EventIntake::Choose(uint32_t block, std::span<const uint32_t> due) noexcept {
  const uint64_t start = block_start_ + block * block_frame_count_;
  auto next_arrival = static_cast<uint32_t>(due.data() - due_.data());
  for (const uint32_t index : due) {
    const MixerEvent& event = pending_[index];
    const uint32_t arrival = next_arrival++;
    BankSlot* slot = banks_.Find(event.bank);
    if (slot == nullptr) {
      Count(counters_.dropped_count, event.ReportCount());
      continue;
    }
    --slot->pending_count;
    if (WasStopped(event, *slot, pending_.tag(index))) continue;
    const bool strikes = event.impulse() != nullptr;
    const Treatment treatment = TreatmentOf(strikes ? event.impulse() : event.beginning(), *slot);
    if (treatment == Treatment::kShed) {
      Count(counters_.shed_count, strikes ? event.ReportCount() : 0);
      continue;
    }
    const bool merged = strikes && treatment == Treatment::kMerged;
    Count(counters_.merged_count, merged ? event.ReportCount() : 0);
    due_order_.push_back(RenderOrder({.section = slot->section,
                                      .block = block,
                                      .slot = event.bank.slot,
                                      .offset = static_cast<uint32_t>(event.FirstSample() - start),
                                      .merged = merged,
                                      .arrival = arrival}));
  }
}

Treatment EventIntake::TreatmentOf(const SurfaceImpulse* impulse,
                                   const BankSlot& slot) const noexcept {
  if (!budget_.bounded() || impulse == nullptr) return Treatment::kExact;
  return triage_.Treat(LoudnessOf(*impulse, slot));
}

void EventIntake::End(size_t block_count) noexcept {
  pending_.Free(due_);
  budget_.End(rendered_work_, static_cast<double>(block_count));
}

bool EventIntake::idle() const noexcept {
  return pending_.empty() && std::ranges::none_of(open_queues_, [](const EventQueue* queue) {
           return queue->kind != StreamKind::kMoves;
         });
}

bool EventIntake::IsShedEarly(const MixerEvent& event, const BankSlot& slot) const noexcept {
  return early_shed_below_ > 0 && event.impulse() != nullptr &&
         event.FirstSample() < block_start_ + kEarlyShedBlocks * block_frame_count_ &&
         LoudnessOf(*event.impulse(), slot) < early_shed_below_;
}

void EventIntake::DecideTreatment(std::span<const uint32_t> due) noexcept {
  triage_.Clear();
  for (const uint32_t index : due) {
    const MixerEvent& event = pending_[index];
    BankSlot* slot = banks_.Find(event.bank);
    if (slot == nullptr || event.impulse() == nullptr) continue;
    if (WasStopped(event, *slot, pending_.tag(index))) continue;
    const double awakening = slot->awakening ? 0 : slot->bank->awakening_work();
    slot->awakening = true;
    triage_.Note(LoudnessOf(*event.impulse(), *slot), slot->bank->strike_work() + awakening,
                 slot->bank->merged_strike_work() + awakening);
  }
  for (const uint32_t index : due) {
    if (BankSlot* slot = banks_.Find(pending_[index].bank)) slot->awakening = false;
  }
  const double taken = work::kTakeEvent * static_cast<double>(std::exchange(taken_count_, 0));
  const double judged = work::kChooseEvent * static_cast<double>(due.size());
  const double spent = ringing_work_ + taken + judged;
  const double most_work = budget_.most_work();
  rendered_work_ += spent + triage_.Decide(std::max(most_work - spent, kStrikingShare * most_work));
  early_shed_below_ = triage_.shed_below() * kEarlyShedRatio;
}

float EventIntake::LoudnessOf(const SurfaceImpulse& impulse, const BankSlot& slot) const noexcept {
  const auto& [x, y, z] = impulse.impulse_newton_seconds;
  const float squared = x * x + y * y + z * z;
  return buses_.bus(slot.bus).fader.target() * slot.loudness_per_newton_second * std::sqrt(squared);
}

double EventIntake::LoudestSquared(uint32_t slot) const noexcept {
  const double gain = buses_.bus(banks_[slot].bus).fader.target();
  return gain * gain * banks_[slot].bank->loudest_squared();
}

uint64_t EventIntake::ShedBanks() noexcept {
  triage_.Clear();
  for (const uint32_t section : buses_.open_sections()) {
    for (const uint32_t index : buses_.section(section).section.sounding()) {
      const OscillatorBank& bank = *banks_[index].bank;
      triage_.Note(static_cast<float>(LoudestSquared(index)), bank.ringing_work(),
                   bank.ringing_work());
    }
  }
  ringing_work_ = triage_.Decide(kRingingShare * budget_.most_work());
  uint64_t shed_count = 0;
  for (const uint32_t section : buses_.open_sections()) {
    for (const uint32_t index : buses_.section(section).section.sounding()) {
      if (triage_.Treat(static_cast<float>(LoudestSquared(index))) != Treatment::kShed) continue;
      banks_[index].bank->Shed();
      ++shed_count;
    }
  }
  return shed_count;
}

}  // namespace carillon
