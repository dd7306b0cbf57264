// SPDX-License-Identifier: Apache-2.0
// The rendering thread's side of the mixer: nothing here allocates, locks, logs, throws or calls
// the system. The vectors never grow beyond what was reserved when the mixer was made.
#include "server/synthesis/mixer.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>

#include "server/synthesis/flush_denormals.h"

namespace carillon {
namespace {

/// Adds to a counter that only this thread writes.
void Count(std::atomic<uint64_t>& counter, uint64_t more = 1) noexcept {
  counter.store(counter.load(std::memory_order_relaxed) + more, std::memory_order_relaxed);
}

}  // namespace

void Mixer::Render(std::span<float> frames) noexcept {
  assert(frames.size() % settings_.block_frame_count == 0);
  const FlushDenormals flush_denormals;
  for (; !frames.empty(); frames = frames.subspan(settings_.block_frame_count)) {
    RenderBlock(frames.first(settings_.block_frame_count));
  }
}

void Mixer::RenderBlock(std::span<float> block) noexcept {
  ObeyCommands();
  TakeStrikes();
  mix_.Clear(block.size());
  StrikeDueBanks();
  RenderBanks();
  mix_.Reduce(block);
  RenderFadingBanks(block);
  DismissSilentBanks();
  RetireLeavingBanks();
  NotePeak(block);
  Count(statistics_.limited_frame_count, limiter_.Apply(block));
  block_start_ += block.size();
  statistics_.frame_count.store(block_start_, std::memory_order_release);
}

void Mixer::ObeyCommands() noexcept {
  for (Command command; commands_.TryPop(command);) Obey(command);
}

void Mixer::Obey(const Command& command) noexcept {
  if (command.kind == Command::Kind::kAddStream) {
    open_queues_.push_back(command.queue);
  } else if (command.kind == Command::Kind::kAddBank) {
    slots_[command.id.slot] = {.bank = command.bank, .generation = command.id.generation};
    Count(statistics_.bank_count);
  } else if (Slot* slot = FindSlot(command.id)) {  // it may have rung out before it was to fade
    if (!slot->leaving) leaving_.push_back(command.id.slot);
    slot->leaving = true;
    slot->fading |= command.kind == Command::Kind::kFadeOut;
  }
}

Mixer::Slot* Mixer::FindSlot(BankId id) noexcept {
  if (id.slot >= slots_.size()) return nullptr;
  Slot& slot = slots_[id.slot];
  return slot.bank != nullptr && slot.generation == id.generation ? &slot : nullptr;
}

void Mixer::TakeStrikes() noexcept {
  // Each block begins with another stream, so that a flood in one does not starve the rest.
  const size_t count = open_queues_.size();
  const size_t first = count == 0 ? 0 : block_start_ / settings_.block_frame_count % count;
  size_t budget = settings_.most_strikes_per_block;
  all_strikes_taken_ = true;
  for (size_t i = 0; i < count; ++i) {
    StrikeQueue& queue = *open_queues_[(first + i) % count];
    for (Strike strike; budget > 0 && queue.ring.TryPop(strike); --budget) Take(strike, queue);
  }
  if (budget == 0) all_strikes_taken_ = false;
  // Asked in this order, a queue that is closed and empty stays empty.
  std::erase_if(open_queues_, [this](StrikeQueue* queue) {
    const bool done = queue->closed.load(std::memory_order_acquire) && queue->ring.empty();
    if (done) SendBack({.queue = queue});
    return done;
  });
}

void Mixer::Take(const Strike& strike, StrikeQueue& queue) noexcept {
  // A bank may have been added, and struck, since the commands of this block were obeyed.
  if (FindSlot(strike.bank) == nullptr) {
    ObeyCommands();
    all_strikes_taken_ = false;
  }
  Slot* slot = FindSlot(strike.bank);
  const bool between = strike.fraction > 0;
  PendingStrike pending{.sample = strike.frame + (between ? 1 : 0),
                        .lead_frames = between ? 1 - strike.fraction : 0,
                        .bank = strike.bank,
                        .kind = strike.kind,
                        .excitation = strike.excitation,
                        .knot = strike.knot};
  const bool late = pending.sample < block_start_;
  if (late) {
    pending.sample = block_start_;
    pending.lead_frames = 0;
  }
  if (slot == nullptr || slot->fading || !pending_.TryPush(pending)) {
    Count(queue.dropped_count);
    return Count(statistics_.dropped_count);
  }
  ++slot->pending_count;
  if (strike.kind != StrikeKind::kImpulse) return;
  Count(late ? queue.late_count : queue.accepted_count);
  Count(late ? statistics_.late_count : statistics_.accepted_count);
}

void Mixer::StrikeDueBanks() noexcept {
  const uint64_t block_end = block_start_ + settings_.block_frame_count;
  size_t budget = settings_.most_strikes_per_block;
  for (; budget > 0 && !pending_.empty() && pending_.front().sample < block_end; --budget) {
    StrikeBank(pending_.front());
    pending_.PopFront();
  }
}

void Mixer::StrikeBank(const PendingStrike& strike) noexcept {
  Slot* slot = FindSlot(strike.bank);
  if (slot == nullptr || slot->fading) return Count(statistics_.dropped_count);
  --slot->pending_count;
  const bool postponed = strike.sample < block_start_;
  Count(statistics_.postponed_count, postponed ? 1 : 0);
  const size_t offset = postponed ? 0 : static_cast<size_t>(strike.sample - block_start_);
  if (!Excite(*slot->bank, strike, offset)) return Count(statistics_.dropped_count);
  if (strike.kind == StrikeKind::kForce) return;  // nothing moves before the knot
  if (!slot->sounding) sounding_.push_back(strike.bank.slot);
  slot->sounding = true;
}

bool Mixer::Excite(OscillatorBank& bank, const PendingStrike& strike, size_t offset) noexcept {
  switch (strike.kind) {
    case StrikeKind::kForce:
      return bank.Gather(strike.excitation);
    case StrikeKind::kKnot:
      return bank.Tie(strike.knot, offset, mix_);
    default:
      return bank.Strike(strike.excitation, offset, strike.lead_frames, mix_);
  }
}

void Mixer::RenderBanks() noexcept {
  uint64_t active_mode_count = 0;
  for (const uint32_t index : sounding_) {
    Slot& slot = slots_[index];
    active_mode_count += slot.bank->active_mode_count();
    if (!slot.fading) RenderBank(slot, mix_);
  }
  statistics_.active_mode_count.store(active_mode_count, std::memory_order_relaxed);
}

void Mixer::RenderBank(Slot& slot, LaneMix& mix) noexcept {
  if (!slot.bank->RenderAdd(mix)) Count(statistics_.reset_bank_count);
}

void Mixer::RenderFadingBanks(std::span<float> block) noexcept {
  std::array<float, kMostBlockFrames> faded;
  for (const uint32_t index : sounding_) {
    Slot& slot = slots_[index];
    if (!slot.fading) continue;
    fading_mix_.Clear(block.size());
    RenderBank(slot, fading_mix_);
    fading_mix_.Reduce(std::span(faded).first(block.size()));
    for (size_t n = 0; n < block.size(); ++n) {
      slot.fade_gain = std::max(slot.fade_gain - fade_step_, 0.0F);
      block[n] += slot.fade_gain * faded[n];
    }
  }
}

void Mixer::DismissSilentBanks() noexcept {
  std::erase_if(sounding_, [this](uint32_t index) {
    Slot& slot = slots_[index];
    slot.sounding = !slot.bank->silent() && slot.fade_gain > 0;
    return !slot.sounding;
  });
}

void Mixer::RetireLeavingBanks() noexcept {
  std::erase_if(leaving_, [this](uint32_t index) {
    Slot& slot = slots_[index];
    const bool awaited = !slot.fading && (slot.pending_count > 0 || !all_strikes_taken_);
    if (slot.sounding || awaited) return false;
    SendBack({.id = {.slot = index, .generation = slot.generation}});
    slot.bank = nullptr;
    statistics_.bank_count.fetch_sub(1, std::memory_order_relaxed);
    return true;
  });
}

void Mixer::SendBack(const Retired& retired) noexcept {
  [[maybe_unused]] const bool sent = retired_.TryPush(retired);  // it has room for all there are
  assert(sent);
}

void Mixer::NotePeak(std::span<const float> block) noexcept {
  float peak = 0;
  for (const float sample : block) peak = std::max(peak, std::abs(sample));
  float noted = peak_.load(std::memory_order_relaxed);
  while (peak > noted && !peak_.compare_exchange_weak(noted, peak, std::memory_order_relaxed)) {
  }
}

}  // namespace carillon
