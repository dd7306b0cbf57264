// SPDX-License-Identifier: Apache-2.0
// The controlling threads' side of the mixer.
#include <cassert>
#include <utility>

#include "absl/strings/str_cat.h"
#include "proto/error_reason.h"
#include "server/synthesis/mixer.h"

namespace carillon {
namespace {

constexpr double kFadeS = 0.01;

}  // namespace

Mixer::Mixer(const MixerSettings& settings)
    : settings_(settings),
      owned_(settings.most_banks),
      // Each bank is added, let ring out and faded at most once before its slot is used again.
      commands_(3 * settings.most_banks + settings.most_streams),
      retired_(settings.most_banks + settings.most_streams),
      fade_step_(static_cast<float>(1 / (kFadeS * settings.sample_rate_hz))),
      slots_(settings.most_banks),
      pending_(settings.most_pending_strikes),
      limiter_(settings.sample_rate_hz) {
  assert(settings.block_frame_count > 0 && settings.block_frame_count <= kMostBlockFrames);
  for (size_t slot = settings.most_banks; slot-- > 0;) {
    free_slots_.push_back(static_cast<uint32_t>(slot));
  }
  sounding_.reserve(settings.most_banks);
  leaving_.reserve(settings.most_banks);
  open_queues_.reserve(settings.most_streams);
}

Mixer::~Mixer() = default;

absl::StatusOr<BankId> Mixer::Add(std::unique_ptr<OscillatorBank> bank) {
  const MutexLock lock(&control_mutex_);
  if (free_slots_.empty()) {
    return Refusal(absl::StatusCode::kResourceExhausted, "TOO_MANY_OBJECTS",
                   absl::StrCat("the mixer holds ", settings_.most_banks,
                                " sounding objects already: remove some"));
  }
  const uint32_t slot = free_slots_.back();
  free_slots_.pop_back();
  OwnedBank& owned = owned_[slot];
  owned = {.bank = std::move(bank), .generation = owned.generation + 1};
  const BankId id{.slot = slot, .generation = owned.generation};
  Send({.kind = Command::Kind::kAddBank, .id = id, .bank = owned.bank.get()});
  return id;
}

void Mixer::LetRingOut(BankId bank) {
  const MutexLock lock(&control_mutex_);
  OwnedBank* owned = Find(bank);
  if (owned == nullptr || owned->leaving) return;
  owned->leaving = true;
  Send({.kind = Command::Kind::kLetRingOut, .id = bank});
}

void Mixer::FadeOut(BankId bank) {
  const MutexLock lock(&control_mutex_);
  OwnedBank* owned = Find(bank);
  if (owned == nullptr || owned->fading) return;
  owned->leaving = owned->fading = true;
  Send({.kind = Command::Kind::kFadeOut, .id = bank});
}

absl::StatusOr<std::unique_ptr<StrikeStream>> Mixer::OpenStream(size_t capacity) {
  auto queue = std::make_shared<StrikeQueue>(capacity);
  const MutexLock lock(&control_mutex_);
  if (queues_.size() == settings_.most_streams) {
    return Refusal(absl::StatusCode::kResourceExhausted, "TOO_MANY_STREAMS",
                   absl::StrCat("the mixer serves ", settings_.most_streams,
                                " contact streams already: close some"));
  }
  queues_.push_back(queue);
  Send({.kind = Command::Kind::kAddStream, .queue = queue.get()});
  return std::make_unique<StrikeStream>(std::move(queue));
}

void Mixer::CollectGarbage() {
  std::vector<std::unique_ptr<OscillatorBank>> garbage;  // freed outside the lock
  const MutexLock lock(&control_mutex_);
  for (Retired retired; retired_.TryPop(retired);) {
    if (retired.queue != nullptr) {
      std::erase_if(queues_, [&](const auto& queue) { return queue.get() == retired.queue; });
    } else {
      garbage.push_back(std::move(owned_[retired.id.slot].bank));
      free_slots_.push_back(retired.id.slot);
    }
  }
}

MixerStatistics Mixer::statistics() const noexcept {
  return {.frame_count = statistics_.frame_count,
          .accepted_count = statistics_.accepted_count,
          .late_count = statistics_.late_count,
          .dropped_count = statistics_.dropped_count,
          .postponed_count = statistics_.postponed_count,
          .reset_bank_count = statistics_.reset_bank_count,
          .limited_frame_count = statistics_.limited_frame_count,
          .bank_count = statistics_.bank_count,
          .active_mode_count = statistics_.active_mode_count};
}

Mixer::OwnedBank* Mixer::Find(BankId id) {
  if (id.slot >= owned_.size()) return nullptr;
  OwnedBank& owned = owned_[id.slot];
  return owned.bank != nullptr && owned.generation == id.generation ? &owned : nullptr;
}

void Mixer::Send(const Command& command) {
  [[maybe_unused]] const bool sent = commands_.TryPush(command);
  assert(sent);
}

}  // namespace carillon
