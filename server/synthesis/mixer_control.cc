// SPDX-License-Identifier: Apache-2.0
// The controlling threads' side of the mixer.
#include <algorithm>
#include <cassert>
#include <numeric>
#include <utility>

#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"
#include "server/synthesis/mixer.h"

namespace carillon {
namespace {

constexpr double kFadeS = 0.01;
/// Spreading this number of modes costs about as much as the transforms of a section.
constexpr size_t kModesPerSection = 4000;

PendingEvents::BlockLimits LimitsOf(const MixerSettings& settings) {
  if (settings.clock == nullptr) return {};
  return {.impulses = kMostImpulsesPerFrame * settings.block_frame_count,
          .others = kMostOthersPerBlock};
}

std::vector<std::unique_ptr<Bus>> MakeBuses(const MixerSettings& settings) {
  std::vector<std::unique_ptr<Bus>> buses;
  for (size_t i = 0; i < settings.most_buses; ++i) {
    buses.push_back(std::make_unique<Bus>(settings.sample_rate_hz));
  }
  return buses;
}

}  // namespace

Mixer::Mixer(const MixerSettings& settings)
    : settings_(settings),
      master_gain_(static_cast<float>(settings.gain)),
      buses_(MakeBuses(settings)),
      owned_(settings.most_banks),
      owned_buses_(settings.most_buses),
      owned_sections_(settings.most_buses * kSectionCount),
      // Each bank is added, let ring out and faded at most once before its slot is used again.
      commands_(3 * settings.most_banks + settings.most_streams),
      retired_(settings.most_banks + settings.most_streams),
      block_start_(settings.first_frame),
      slots_(settings.most_banks),
      slots_of_sections_(slots_),
      leaving_(settings.most_banks),
      open_queues_(settings.most_streams),
      pending_(settings.most_pending_events, settings.block_frame_count, settings.most_buses,
               LimitsOf(settings)),
      due_(settings.most_pending_events),
      due_order_(settings.most_pending_events),
      due_events_(settings.most_pending_events),
      budget_(settings.clock,
              static_cast<double>(settings.block_frame_count) / settings.sample_rate_hz,
              settings.most_load),
      sections_(settings.most_buses * kSectionCount),
      open_sections_(settings.most_buses * kSectionCount),
      gains_(kBlocksTogether * settings.block_frame_count),
      bus_frames_(gains_.size()),
      bus_placed_(gains_.size() * settings.channel_count),
      mixed_frames_(gains_.size()),
      mixed_placed_(bus_placed_.size()),
      master_(settings.sample_rate_hz, static_cast<float>(settings.gain)),
      limiter_(settings.sample_rate_hz, settings.channel_count) {
  assert(settings.block_frame_count > 0 && settings.block_frame_count <= kMostBlockFrames);
  assert(settings.first_frame % settings.block_frame_count == 0);
  assert(settings.most_banks <= RenderOrder::kMostSlots);
  assert(settings.most_pending_events <= RenderOrder::kMostArrivals);
  assert(settings.most_buses > 0 && settings.most_buses <= kMostBuses);
  // The rendering thread must not wait for pages.
  commands_.TouchMemory();
  retired_.TouchMemory();
  statistics_.frame_count = settings.first_frame;
  owned_buses_[0].open = true;
  const size_t thread_count = settings.threads == nullptr ? 1 : settings.threads->size();
  for (size_t i = 0; i < thread_count; ++i) workspaces_.emplace_back(settings.block_frame_count);
  for (size_t slot = settings.most_banks; slot-- > 0;) {
    free_slots_.push_back(static_cast<uint32_t>(slot));
  }
}

Mixer::~Mixer() = default;

absl::StatusOr<BankId> Mixer::Add(std::unique_ptr<OscillatorBank> bank,
                                  std::shared_ptr<Voice> voice, BusId bus) {
  const MutexLock lock(&control_mutex_);
  if (free_slots_.empty()) {
    return Refusal(absl::StatusCode::kResourceExhausted, "TOO_MANY_OBJECTS",
                   absl::StrCat("the mixer holds ", settings_.most_banks,
                                " sounding objects already: remove some"));
  }
  const uint32_t slot = free_slots_.back();
  free_slots_.pop_back();
  OwnedBank& owned = owned_[slot];
  const size_t mode_count = bank->mode_count();
  const uint32_t section =
      voice != nullptr && voice->section ? *voice->section : ChooseSection(bus);
  if (voice != nullptr) voice->section = section;
  owned = {.bank = std::move(bank),
           .voice = std::move(voice),
           .generation = owned.generation + 1,
           .section = section,
           .mode_count = mode_count};
  owned_buses_[bus.index].mode_counts[section % kSectionCount] += mode_count;
  ++owned_buses_[bus.index].bank_count;
  const BankId id{.slot = slot, .generation = owned.generation};
  Send({.kind = Command::Kind::kAddBank,
        .id = id,
        .bank = owned.bank.get(),
        .voice = owned.voice.get(),
        .section = owned.section,
        .opened = MakeSection(owned.section)});
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

absl::StatusOr<std::unique_ptr<EventStream>> Mixer::OpenStream(size_t capacity, StreamKind kind) {
  auto queue = std::make_shared<EventQueue>(capacity, kind);
  {
    const MutexLock lock(&control_mutex_);
    if (queues_.size() == settings_.most_streams) {
      return Refusal(absl::StatusCode::kResourceExhausted, "TOO_MANY_STREAMS",
                     absl::StrCat("the mixer serves ", settings_.most_streams,
                                  " contact streams already: close some"));
    }
    queues_.push_back(queue);
    Send({.kind = Command::Kind::kAddStream, .queue = queue.get()});
  }
  if (settings_.wake && kind != StreamKind::kMoves) settings_.wake();
  return std::make_unique<EventStream>(std::move(queue));
}

void Mixer::CollectGarbage() {
  std::vector<std::unique_ptr<OscillatorBank>> garbage;  // freed outside the lock
  std::vector<std::shared_ptr<Voice>> silent_voices;
  const MutexLock lock(&control_mutex_);
  for (Retired retired; retired_.TryPop(retired);) {
    if (retired.queue != nullptr) {
      std::erase_if(queues_, [&](const auto& queue) { return queue.get() == retired.queue; });
    } else {
      OwnedBank& owned = owned_[retired.id.slot];
      OwnedBus& bus = owned_buses_[owned.section / kSectionCount];
      bus.mode_counts[owned.section % kSectionCount] -= owned.mode_count;
      --bus.bank_count;
      garbage.push_back(std::move(owned.bank));
      silent_voices.push_back(std::move(owned.voice));
      free_slots_.push_back(retired.id.slot);
    }
  }
}

MixerStatistics Mixer::statistics() const noexcept {
  return {.frame_count = statistics_.frame_count,
          .accepted_count = statistics_.accepted_count,
          .late_count = statistics_.late_count,
          .dropped_count = statistics_.dropped_count,
          .merged_count = statistics_.merged_count,
          .shed_count = statistics_.shed_count,
          .shed_bank_count = statistics_.shed_bank_count,
          .reset_bank_count = statistics_.reset_bank_count,
          .bounded_bank_count = statistics_.bounded_bank_count,
          .limited_frame_count = statistics_.limited_frame_count,
          .bank_count = statistics_.bank_count,
          .active_mode_count = statistics_.active_mode_count};
}

size_t Mixer::mode_count() {
  const MutexLock lock(&control_mutex_);
  size_t count = 0;
  for (const OwnedBus& bus : owned_buses_) {
    count = std::accumulate(bus.mode_counts.begin(), bus.mode_counts.end(), count);
  }
  return count;
}

/// The section of the bus with the fewest modes. A bus with few modes uses few sections, because
/// each section pays for transforms of its own.
uint32_t Mixer::ChooseSection(BusId bus) const {
  const auto& mode_counts = owned_buses_[bus.index].mode_counts;
  const auto begin = mode_counts.begin();
  const size_t mode_count = std::accumulate(begin, mode_counts.end(), size_t{0});
  const size_t used = std::min(mode_count / kModesPerSection + 1, kSectionCount);
  const auto chosen = std::min_element(begin, begin + static_cast<ptrdiff_t>(used)) - begin;
  return static_cast<uint32_t>(bus.index * kSectionCount + static_cast<size_t>(chosen));
}

MixedSection* Mixer::MakeSection(uint32_t section) {
  std::unique_ptr<MixedSection>& owned = owned_sections_[section];
  if (owned != nullptr) return nullptr;
  const BusId bus{static_cast<uint32_t>(section / kSectionCount)};
  owned = std::make_unique<MixedSection>(
      RenderSection::Settings{
          .block_frame_count = settings_.block_frame_count,
          .stagger =
              (section + (bus == BusId() ? settings_.stagger : Stagger(bus))) % kSectionCount,
          .most_banks = settings_.most_banks,
          .fade_step = static_cast<float>(1 / (kFadeS * settings_.sample_rate_hz)),
          .channel_count = settings_.channel_count},
      slots_of_sections_, kBlocksTogether * settings_.block_frame_count);
  return owned.get();
}

absl::StatusOr<BusId> Mixer::OpenBus(double gain) {
  const MutexLock lock(&control_mutex_);
  const auto free = std::ranges::find_if(
      owned_buses_, [](const OwnedBus& bus) { return !bus.open && bus.bank_count == 0; });
  if (free == owned_buses_.end()) {
    return Refusal(absl::StatusCode::kResourceExhausted, "TOO_MANY_SCENES",
                   absl::StrCat("the mixer holds the sound of ", settings_.most_buses,
                                " scenes already: delete some"));
  }
  free->open = true;
  const BusId id{static_cast<uint32_t>(free - owned_buses_.begin())};
  Bus& bus = *buses_[id.index];
  bus.gain = static_cast<float>(gain);
  bus.jumps.store(true, std::memory_order_release);
  return id;
}

void Mixer::CloseBus(BusId bus) {
  BusListener* const listener = buses_[bus.index]->listener.exchange(nullptr);
  if (listener != nullptr) listener->End();
  const MutexLock lock(&control_mutex_);
  owned_buses_[bus.index].open = false;
}

void Mixer::SetGain(BusId bus, double gain) {
  buses_[bus.index]->gain.store(static_cast<float>(gain), std::memory_order_relaxed);
}

void Mixer::Stop(BusId bus) { ++buses_[bus.index]->stops_asked; }

void Mixer::Tap(BusId bus, BusListener* listener) {
  buses_[bus.index]->listener.store(listener, std::memory_order_release);
}

BusState Mixer::State(BusId bus) const {
  return {.active_mode_count = buses_[bus.index]->active_mode_count.load(std::memory_order_relaxed),
          .peak = buses_[bus.index]->peak.load(std::memory_order_relaxed)};
}

size_t Mixer::Stagger(BusId bus) {
  // The first bus that is opened begins as the default one does. Each further one begins in the
  // middle between others: 0, 8, 4, 12, 2, ...
  const uint32_t number = bus.index == 0 ? 0 : (bus.index - 1) % kSectionCount;
  return (number & 1U) << 3U | (number & 2U) << 1U | (number & 4U) >> 1U | (number & 8U) >> 3U;
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
