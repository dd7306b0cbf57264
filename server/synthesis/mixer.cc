// SPDX-License-Identifier: Apache-2.0
#include "server/synthesis/mixer.h"

#include <algorithm>
#include <cassert>
#include <utility>

#include "server/synthesis/flush_denormals.h"
#include "server/synthesis/frames.h"

namespace carillon {
namespace {

Buses MakeBuses(const MixerSettings& settings) {
  Buses buses;
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
      banks_(settings.most_banks),
      owner_(settings, banks_.slots()),
      block_start_(settings.first_frame),
      leaving_(settings.most_banks),
      bus_mixer_(settings, buses_, counters_),
      intake_(settings, banks_, bus_mixer_, counters_),
      limiter_(settings.sample_rate_hz, settings.channel_count) {
  assert(settings.block_frame_count > 0 && settings.block_frame_count <= kMostBlockFrames);
  assert(settings.first_frame % settings.block_frame_count == 0);
  assert(settings.most_banks <= RenderOrder::kMostSlots);
  assert(settings.most_pending_events <= RenderOrder::kMostArrivals);
  assert(settings.most_buses > 0 && settings.most_buses <= kMostBuses);
  counters_.frame_count = settings.first_frame;
  const size_t thread_count = settings.threads == nullptr ? 1 : settings.threads->size();
  for (size_t i = 0; i < thread_count && !settings.shares_workspace; ++i) {
    workspaces_.emplace_back(settings.block_frame_count);
  }
}

Mixer::~Mixer() = default;

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

// Nothing that Render calls allocates, locks, logs, throws or calls the system. The vectors never
// grow beyond what was reserved when the mixer was made.
void Mixer::RenderBlocks(std::span<float> frames) noexcept {
  const size_t frame_count = frames.size() / settings_.channel_count;
  const size_t block_count = frame_count / settings_.block_frame_count;
  intake_.Begin();
  ExecuteCommands();
  bus_mixer_.ListenToControl(master_gain_.load(std::memory_order_relaxed));
  TakeEvents(block_count);
  intake_.CollectDue(block_count);
  RenderSections(frame_count);
  bus_mixer_.Mix(block_start_, frames);
  bus_mixer_.EndStops();
  RetireLeavingBanks();
  NotePeak(frames);
  if (settings_.limits) Count(counters_.limited_frame_count, limiter_.Apply(frames));
  block_start_ += frame_count;
  counters_.frame_count.store(block_start_, std::memory_order_release);
  intake_.End(block_count);
  resting_.store(intake_.idle() && !bus_mixer_.sounded(), std::memory_order_relaxed);
}

void Mixer::ExecuteCommands() noexcept {
  for (MixerCommand command; owner_.TryTake(command);) Execute(command);
}

void Mixer::Execute(const MixerCommand& command) noexcept {
  if (command.kind == MixerCommand::Kind::kAddStream) return intake_.Open(*command.queue);
  if (command.kind == MixerCommand::Kind::kAddBank) return AddBank(command);
  BankSlot* const slot = banks_.Find(command.id);
  if (slot == nullptr) return;  // the bank rang out before it was to fade
  if (!slot->leaving) leaving_.push_back(command.id.slot);
  slot->leaving = true;
  if (command.kind != MixerCommand::Kind::kFadeOut) return;
  slot->fading = true;
  slot->bank->LeaveSpectrum();
}

void Mixer::AddBank(const MixerCommand& command) noexcept {
  if (command.opened != nullptr) bus_mixer_.Open(command.section, *command.opened);
  banks_[command.id.slot] = {
      .bank = command.bank,
      .voice = command.voice,
      .generation = command.id.generation,
      .section = command.section,
      .bus = BusOfSection(command.section),
      .loudness_per_newton_second = command.bank->loudness_per_newton_second()};
  Count(counters_.bank_count);
  if (command.voice == nullptr) return;
  ++command.voice->bank_count;
  // A voice is fed in the time domain.
  command.bank->LeaveSpectrum();
  if (const DirectedGains* gains = command.bank->gains()) {
    command.voice->SetCenter(gains->center_m());
  }
}

void Mixer::TakeEvents(size_t block_count) noexcept {
  const auto execute_commands = [this] {
    const InRole role(kRenderRole);
    ExecuteCommands();
  };
  const auto retire = [this](EventQueue& queue) { owner_.SendBack({.queue = &queue}); };
  intake_.Take(block_start_, block_count, execute_commands, retire);
}

void Mixer::RenderSections(size_t frame_count) noexcept {
  const std::span<const uint32_t> open = bus_mixer_.open_sections();
  const auto render = [&](size_t thread, size_t index) {
    const InRole role(kRenderRole);  // each of the threads that render sections has it
    RenderOneSection(thread, bus_mixer_.section(open[index]), frame_count);
  };
  if (settings_.threads != nullptr) return settings_.threads->Render(open.size(), render);
  for (size_t index = 0; index < open.size(); ++index) render(0, index);
}

void Mixer::RenderOneSection(size_t thread, MixedSection& mixed, size_t frame_count) noexcept {
  mixed.counts = mixed.section.Render(
      block_start_ / settings_.block_frame_count, mixed.due,
      {.frames = std::span(mixed.frames).first(frame_count),
       .placed = std::span(mixed.placed).first(frame_count * settings_.channel_count)},
      workspace_ != nullptr ? *workspace_ : workspaces_[thread]);
}

void Mixer::RetireLeavingBanks() noexcept {
  leaving_.EraseIf([this](uint32_t index) ABSL_EXCLUSIVE_LOCKS_REQUIRED(kRenderRole) {
    BankSlot& slot = banks_[index];
    const bool awaited = !slot.fading && (slot.pending_count > 0 || !intake_.all_taken());
    // The last bank of a voice stays until the voice has delivered all of its delayed sound.
    const bool last_of_voice = slot.voice != nullptr && slot.voice->bank_count == 1;
    if (slot.sounding || awaited || (last_of_voice && !slot.voice->asleep())) return false;
    if (slot.voice != nullptr) --slot.voice->bank_count;
    owner_.SendBack({.id = {.slot = index, .generation = slot.generation}});
    slot.bank = nullptr;
    slot.voice = nullptr;
    counters_.bank_count.fetch_sub(1, std::memory_order_relaxed);
    return true;
  });
}

void Mixer::NotePeak(std::span<const float> block) noexcept {
  const float peak = LargestMagnitude(block);
  float noted = peak_.load(std::memory_order_relaxed);
  while (peak > noted && !peak_.compare_exchange_weak(noted, peak, std::memory_order_relaxed)) {
  }
}

absl::StatusOr<BankId> Mixer::Add(std::unique_ptr<OscillatorBank> bank,
                                  std::shared_ptr<Voice> voice, BusId bus) {
  return owner_.Add(std::move(bank), std::move(voice), bus);
}

absl::StatusOr<std::unique_ptr<EventStream>> Mixer::OpenStream(size_t capacity, StreamKind kind) {
  auto stream = owner_.OpenStream(capacity, kind);
  if (stream.ok() && kind != StreamKind::kMoves) Wake();
  return stream;
}

absl::StatusOr<BusId> Mixer::OpenBus(double gain) {
  absl::StatusOr<BusId> id = owner_.OpenBus();
  if (!id.ok()) return id;
  Bus& bus = *buses_[id->index];
  bus.gain = static_cast<float>(gain);
  bus.jumps.store(true, std::memory_order_release);
  return id;
}

void Mixer::CloseBus(BusId bus) {
  BusListener* const listener = buses_[bus.index]->listener.exchange(nullptr);
  if (listener != nullptr) listener->End();
  owner_.CloseBus(bus);
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

}  // namespace carillon
