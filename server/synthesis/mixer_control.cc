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

}  // namespace

Mixer::Mixer(const MixerSettings& settings)
    : settings_(settings),
      owned_(settings.most_banks),
      // Each bank is added, let ring out and faded at most once before its slot is used again.
      commands_(3 * settings.most_banks + settings.most_streams),
      retired_(settings.most_banks + settings.most_streams),
      block_start_(settings.first_frame),
      slots_(settings.most_banks),
      leaving_(settings.most_banks),
      open_queues_(settings.most_streams),
      pending_(settings.most_pending_events, settings.block_frame_count),
      due_(settings.most_pending_events),
      due_order_(settings.most_pending_events),
      due_events_(settings.most_pending_events),
      budget_(settings.clock,
              static_cast<double>(settings.block_frame_count) / settings.sample_rate_hz,
              settings.most_load),
      section_frames_(kSectionCount * kBlocksTogether * settings.block_frame_count),
      placed_frames_(section_frames_.size() * settings.channel_count),
      mixed_frames_(kBlocksTogether * settings.block_frame_count),
      limiter_(settings.sample_rate_hz, settings.channel_count) {
  assert(settings.block_frame_count > 0 && settings.block_frame_count <= kMostBlockFrames);
  assert(settings.first_frame % settings.block_frame_count == 0);
  assert(settings.most_banks <= RenderOrder::kMostSlots);
  assert(settings.most_pending_events <= RenderOrder::kMostArrivals);
  statistics_.frame_count = settings.first_frame;
  const size_t thread_count = settings.threads == nullptr ? 1 : settings.threads->size();
  for (size_t i = 0; i < thread_count; ++i) workspaces_.emplace_back(settings.block_frame_count);
  for (size_t section = 0; section < kSectionCount; ++section) {
    sections_.emplace_back(RenderSection::Settings{.block_frame_count = settings.block_frame_count,
                                                   .stagger = section,
                                                   .most_banks = settings.most_banks,
                                                   .fade_step = static_cast<float>(
                                                       1 / (kFadeS * settings.sample_rate_hz)),
                                                   .channel_count = settings.channel_count},
                           slots_);
  }
  for (size_t slot = settings.most_banks; slot-- > 0;) {
    free_slots_.push_back(static_cast<uint32_t>(slot));
  }
}

Mixer::~Mixer() = default;

absl::StatusOr<BankId> Mixer::Add(std::unique_ptr<OscillatorBank> bank,
                                  std::shared_ptr<Voice> voice) {
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
  const uint32_t section = voice != nullptr && voice->section ? *voice->section : ChooseSection();
  if (voice != nullptr) voice->section = section;
  owned = {.bank = std::move(bank),
           .voice = std::move(voice),
           .generation = owned.generation + 1,
           .section = section,
           .mode_count = mode_count};
  section_mode_counts_[owned.section] += mode_count;
  const BankId id{.slot = slot, .generation = owned.generation};
  Send({.kind = Command::Kind::kAddBank,
        .id = id,
        .bank = owned.bank.get(),
        .voice = owned.voice.get(),
        .section = owned.section});
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

absl::StatusOr<std::unique_ptr<EventStream>> Mixer::OpenStream(size_t capacity) {
  auto queue = std::make_shared<EventQueue>(capacity);
  const MutexLock lock(&control_mutex_);
  if (queues_.size() == settings_.most_streams) {
    return Refusal(absl::StatusCode::kResourceExhausted, "TOO_MANY_STREAMS",
                   absl::StrCat("the mixer serves ", settings_.most_streams,
                                " contact streams already: close some"));
  }
  queues_.push_back(queue);
  Send({.kind = Command::Kind::kAddStream, .queue = queue.get()});
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
      section_mode_counts_[owned.section] -= owned.mode_count;
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
  return std::accumulate(section_mode_counts_.begin(), section_mode_counts_.end(), size_t{0});
}

/// The section with the fewest modes. A mixer with few modes uses few sections, because each
/// section pays for transforms of its own.
uint32_t Mixer::ChooseSection() const {
  const auto begin = section_mode_counts_.begin();
  const size_t mode_count = std::accumulate(begin, section_mode_counts_.end(), size_t{0});
  const size_t used = std::min(mode_count / kModesPerSection + 1, kSectionCount);
  return static_cast<uint32_t>(std::min_element(begin, begin + static_cast<ptrdiff_t>(used)) -
                               begin);
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
