// SPDX-License-Identifier: Apache-2.0
#include "server/synthesis/bank_owner.h"

#include <algorithm>
#include <cassert>
#include <numeric>
#include <utility>

#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"

namespace carillon {
namespace {

constexpr double kFadeS = 0.01;
/// Spreading this number of modes costs about as much as the transforms of a section.
constexpr size_t kModesPerSection = 4000;

}  // namespace

BankOwner::BankOwner(const MixerSettings& settings, std::span<BankSlot> slots)
    : settings_(settings),
      slots_(slots),
      banks_(settings.most_banks),
      buses_(settings.most_buses),
      sections_(settings.most_buses * kSectionCount),
      // Each bank is added, let ring out and faded at most once before its slot is used again.
      commands_(3 * settings.most_banks + settings.most_streams),
      retired_(settings.most_banks + settings.most_streams) {
  // The rendering thread must not wait for pages.
  commands_.TouchMemory();
  retired_.TouchMemory();
  buses_[0].open = true;
  for (size_t slot = settings.most_banks; slot-- > 0;) {
    free_slots_.push_back(static_cast<uint32_t>(slot));
  }
}

absl::StatusOr<BankId> BankOwner::Add(std::unique_ptr<OscillatorBank> bank,
                                      std::shared_ptr<Voice> voice, BusId bus) {
  const MutexLock lock(&mutex_);
  if (free_slots_.empty()) {
    return Refusal(absl::StatusCode::kResourceExhausted, "TOO_MANY_OBJECTS",
                   absl::StrCat("the mixer holds ", settings_.most_banks,
                                " sounding objects already: remove some"));
  }
  const uint32_t slot = free_slots_.back();
  free_slots_.pop_back();
  OwnedBank& owned = banks_[slot];
  const size_t mode_count = bank->mode_count();
  const uint32_t section =
      voice != nullptr && voice->section ? *voice->section : ChooseSection(bus);
  if (voice != nullptr) voice->section = section;
  owned = {.bank = std::move(bank),
           .voice = std::move(voice),
           .generation = owned.generation + 1,
           .section = section,
           .mode_count = mode_count};
  buses_[bus.index].mode_counts[section % kSectionCount] += mode_count;
  ++buses_[bus.index].bank_count;
  const BankId id{.slot = slot, .generation = owned.generation};
  Send({.kind = MixerCommand::Kind::kAddBank,
        .id = id,
        .bank = owned.bank.get(),
        .voice = owned.voice.get(),
        .section = owned.section,
        .opened = MakeSection(owned.section)});
  return id;
}

void BankOwner::LetRingOut(BankId bank) {
  const MutexLock lock(&mutex_);
  OwnedBank* owned = Find(bank);
  if (owned == nullptr || owned->leaving) return;
  owned->leaving = true;
  Send({.kind = MixerCommand::Kind::kLetRingOut, .id = bank});
}

void BankOwner::FadeOut(BankId bank) {
  const MutexLock lock(&mutex_);
  OwnedBank* owned = Find(bank);
  if (owned == nullptr || owned->fading) return;
  owned->leaving = owned->fading = true;
  Send({.kind = MixerCommand::Kind::kFadeOut, .id = bank});
}

absl::StatusOr<std::unique_ptr<EventStream>> BankOwner::OpenStream(size_t capacity,
                                                                   StreamKind kind) {
  auto queue = std::make_shared<EventQueue>(capacity, kind);
  const MutexLock lock(&mutex_);
  if (queues_.size() == settings_.most_streams) {
    return Refusal(absl::StatusCode::kResourceExhausted, "TOO_MANY_STREAMS",
                   absl::StrCat("the mixer serves ", settings_.most_streams,
                                " contact streams already: close some"));
  }
  queues_.push_back(queue);
  Send({.kind = MixerCommand::Kind::kAddStream, .queue = queue.get()});
  return std::make_unique<EventStream>(std::move(queue));
}

void BankOwner::CollectGarbage() {
  std::vector<std::unique_ptr<OscillatorBank>> garbage;  // freed outside the lock
  std::vector<std::shared_ptr<Voice>> silent_voices;
  const MutexLock lock(&mutex_);
  for (MixerRetired retired; retired_.TryPop(retired);) {
    if (retired.queue != nullptr) {
      std::erase_if(queues_, [&](const auto& queue) { return queue.get() == retired.queue; });
    } else {
      OwnedBank& owned = banks_[retired.id.slot];
      OwnedBus& bus = buses_[owned.section / kSectionCount];
      bus.mode_counts[owned.section % kSectionCount] -= owned.mode_count;
      --bus.bank_count;
      garbage.push_back(std::move(owned.bank));
      silent_voices.push_back(std::move(owned.voice));
      free_slots_.push_back(retired.id.slot);
    }
  }
}

size_t BankOwner::mode_count() const {
  const MutexLock lock(&mutex_);
  size_t count = 0;
  for (const OwnedBus& bus : buses_) {
    count = std::accumulate(bus.mode_counts.begin(), bus.mode_counts.end(), count);
  }
  return count;
}

/// The section of the bus with the fewest modes. A bus with few modes uses few sections, because
/// each section pays for transforms of its own.
uint32_t BankOwner::ChooseSection(BusId bus) const {
  const auto& mode_counts = buses_[bus.index].mode_counts;
  const auto begin = mode_counts.begin();
  const size_t mode_count = std::accumulate(begin, mode_counts.end(), size_t{0});
  const size_t used = std::min(mode_count / kModesPerSection + 1, kSectionCount);
  const auto chosen = std::min_element(begin, begin + static_cast<ptrdiff_t>(used)) - begin;
  return static_cast<uint32_t>(bus.index * kSectionCount + static_cast<size_t>(chosen));
}

MixedSection* BankOwner::MakeSection(uint32_t section) {
  std::unique_ptr<MixedSection>& owned = sections_[section];
  if (owned != nullptr) return nullptr;
  const BusId bus{static_cast<uint32_t>(section / kSectionCount)};
  owned = std::make_unique<MixedSection>(
      RenderSection::Settings{
          .block_frame_count = settings_.block_frame_count,
          .stagger =
              (section + (bus == BusId() ? settings_.stagger : StaggerOf(bus))) % kSectionCount,
          .most_banks = settings_.most_banks,
          .fade_step = static_cast<float>(1 / (kFadeS * settings_.sample_rate_hz)),
          .channel_count = settings_.channel_count},
      slots_, kBlocksTogether * settings_.block_frame_count);
  return owned.get();
}

absl::StatusOr<BusId> BankOwner::OpenBus() {
  const MutexLock lock(&mutex_);
  const auto free = std::ranges::find_if(
      buses_, [](const OwnedBus& bus) { return !bus.open && bus.bank_count == 0; });
  if (free == buses_.end()) {
    return Refusal(absl::StatusCode::kResourceExhausted, "TOO_MANY_SCENES",
                   absl::StrCat("the mixer holds the sound of ", settings_.most_buses,
                                " scenes already: delete some"));
  }
  free->open = true;
  return BusId{static_cast<uint32_t>(free - buses_.begin())};
}

void BankOwner::CloseBus(BusId bus) {
  const MutexLock lock(&mutex_);
  buses_[bus.index].open = false;
}

void BankOwner::SendBack(const MixerRetired& retired) noexcept {
  // There is room for every bank and stream.
  [[maybe_unused]] const bool sent = retired_.TryPush(retired);
  assert(sent);
}

BankOwner::OwnedBank* BankOwner::Find(BankId id) {
  if (id.slot >= banks_.size()) return nullptr;
  OwnedBank& owned = banks_[id.slot];
  return owned.bank != nullptr && owned.generation == id.generation ? &owned : nullptr;
}

void BankOwner::Send(const MixerCommand& command) {
  [[maybe_unused]] const bool sent = commands_.TryPush(command);
  assert(sent);
}

size_t StaggerOf(BusId bus) {
  // The first bus that is opened begins as the default one does. Each further one begins in the
  // middle between others: 0, 8, 4, 12, 2, ...
  const uint32_t number = bus.index == 0 ? 0 : (bus.index - 1) % kSectionCount;
  return (number & 1U) << 3U | (number & 2U) << 1U | (number & 4U) >> 1U | (number & 8U) >> 3U;
}

}  // namespace carillon
