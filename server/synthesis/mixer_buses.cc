// SPDX-License-Identifier: Apache-2.0
// The buses of the mixer as the rendering thread mixes them: nothing here allocates, locks, logs,
// throws or calls the system.
#include <algorithm>
#include <cmath>

#include "server/synthesis/frames.h"
#include "server/synthesis/mixer.h"

namespace carillon {
namespace {

/// The time in which a shown peak falls by a factor of e: 40 dB in a second.
constexpr double kPeakFallS = 0.217;

void LetPeakFall(Bus& bus, double seconds) noexcept {
  const float peak = bus.peak.load(std::memory_order_relaxed);
  if (peak == 0) return;
  const auto kept = static_cast<float>(std::exp(-seconds / kPeakFallS));
  bus.peak.store(peak * kept, std::memory_order_relaxed);
}

}  // namespace

void Mixer::OpenSection(uint32_t section, MixedSection* opened) noexcept {
  sections_[section] = opened;
  const bool is_first = std::ranges::none_of(open_sections_, [section](uint32_t other) {
    return other / kSectionCount == section / kSectionCount;
  });
  if (is_first) {
    // No bank of the bus rings yet, so neither the gain nor a stop needs a glide.
    Bus& bus = *buses_[section / kSectionCount];
    bus.fader.JumpTo(bus.gain.load(std::memory_order_relaxed));
    bus.stop_count = bus.stops_asked.load(std::memory_order_relaxed);
  }
  open_sections_.push_back(section);
  std::ranges::sort(open_sections_);
}

void Mixer::ListenToControl() noexcept {
  master_.GlideTo(master_gain_.load(std::memory_order_relaxed));
  const Bus* last = nullptr;
  for (const uint32_t section : open_sections_) {
    Bus& bus = *buses_[section / kSectionCount];
    if (&bus != last) bus.Listen();
    last = &bus;
  }
}

void Mixer::MixBuses(std::span<float> frames) noexcept {
  const size_t channels = settings_.channel_count;
  const size_t frame_count = frames.size() / channels;
  std::ranges::fill(std::span(mixed_frames_).first(frame_count), 0.0F);
  std::ranges::fill(std::span(mixed_placed_).first(frames.size()), 0.0F);
  active_mode_count_ = 0;
  ringing_work_ = 0;
  bool placed = false;
  for (auto first = open_sections_.begin(); first != open_sections_.end();) {
    const auto bus = static_cast<uint32_t>(*first / kSectionCount);
    const auto last = std::find_if(first, open_sections_.end(), [bus](uint32_t section) {
      return section / kSectionCount != bus;
    });
    placed |= MixBus(bus, {first, last}, frame_count);
    first = last;
  }
  statistics_.active_mode_count.store(active_mode_count_, std::memory_order_relaxed);
  Spread(mixed_frames_, channels, frames);
  if (placed) AddTo(mixed_placed_, frames);
  if (master_.neutral()) return;
  const std::span<float> gains = std::span(gains_).first(frame_count);
  std::ranges::fill(gains, 1.0F);
  master_.Multiply(gains);
  MultiplyFrames(gains, channels, frames);
}

bool Mixer::MixBus(uint32_t bus, std::span<const uint32_t> sections, size_t frame_count) noexcept {
  Bus& mixed_bus = *buses_[bus];
  bool placed = false;
  mixed_bus.sounded = false;
  uint64_t active_mode_count = 0;
  for (const uint32_t number : sections) {
    const SectionCounts& counts = sections_[number]->counts;
    CountSection(counts);
    active_mode_count += counts.active_mode_count;
    mixed_bus.sounded |= counts.sounded;
    placed |= counts.placed;
  }
  active_mode_count_ += active_mode_count;
  mixed_bus.active_mode_count.store(active_mode_count, std::memory_order_relaxed);
  LetPeakFall(mixed_bus, static_cast<double>(frame_count) / settings_.sample_rate_hz);
  // Most buses of a daemon belong to scenes at rest, which should cost nothing.
  const bool heard = mixed_bus.listener.load(std::memory_order_relaxed) != nullptr;
  if (!mixed_bus.sounded && !heard && !mixed_bus.changes()) return false;
  AddSections(sections, frame_count);
  ApplyGains(mixed_bus, frame_count);
  LetHear(mixed_bus, frame_count);
  if (!mixed_bus.sounded) return false;
  const std::span<const float> frames = std::span(bus_frames_).first(frame_count);
  float peak = LargestMagnitude(frames);
  AddTo(frames, std::span(mixed_frames_).first(frame_count));
  if (placed) {
    const auto directed = std::span(bus_placed_).first(frame_count * settings_.channel_count);
    peak = std::max(peak, LargestMagnitude(directed));
    AddTo(directed, std::span(mixed_placed_).first(directed.size()));
  }
  const float fallen = mixed_bus.peak.load(std::memory_order_relaxed);
  mixed_bus.peak.store(std::max(fallen, peak), std::memory_order_relaxed);
  return placed;
}

void Mixer::AddSections(std::span<const uint32_t> sections, size_t frame_count) noexcept {
  const std::span<float> frames = std::span(bus_frames_).first(frame_count);
  const auto placed = std::span(bus_placed_).first(frame_count * settings_.channel_count);
  std::ranges::fill(frames, 0.0F);
  std::ranges::fill(placed, 0.0F);
  for (const uint32_t number : sections) {
    const MixedSection& section = *sections_[number];
    if (section.counts.sounded) AddTo(section.frames, frames);
    if (section.counts.placed) AddTo(section.placed, placed);
  }
}

void Mixer::CountSection(const SectionCounts& counts) noexcept {
  const auto count = [](std::atomic<uint64_t>& counter, uint64_t more) {
    counter.store(counter.load(std::memory_order_relaxed) + more, std::memory_order_relaxed);
  };
  count(statistics_.dropped_count, counts.dropped_count);
  count(statistics_.reset_bank_count, counts.reset_bank_count);
  count(statistics_.bounded_bank_count, counts.bounded_bank_count);
  ringing_work_ += counts.ringing_work;
}

void Mixer::ApplyGains(Bus& bus, size_t frame_count) noexcept {
  if (bus.fader.neutral() && bus.stop.neutral()) return;
  const std::span<float> gains = std::span(gains_).first(frame_count);
  std::ranges::fill(gains, 1.0F);
  bus.fader.Multiply(gains);
  bus.stop.Multiply(gains);
  const size_t channels = settings_.channel_count;
  MultiplyFrames(gains, 1, std::span(bus_frames_).first(frame_count));
  MultiplyFrames(gains, channels, std::span(bus_placed_).first(frame_count * channels));
}

void Mixer::LetHear(Bus& bus, size_t frame_count) noexcept {
  BusListener* const listener = bus.listener.load(std::memory_order_acquire);
  if (listener == nullptr) return;
  const size_t channels = settings_.channel_count;
  const size_t block = settings_.block_frame_count;
  std::array<float, 2 * kMostBlockFrames> heard;
  const std::span<float> frames = std::span(heard).first(block * channels);
  for (size_t first = 0; first < frame_count; first += block) {
    Spread(std::span(bus_frames_).subspan(first), channels, frames);
    AddTo(std::span(bus_placed_).subspan(first * channels), frames);
    listener->Hear(block_start_ + first, frames);
  }
}

/// Silences the buses that have faded out, and gives them their gain back.
void Mixer::EndStops() noexcept {
  for (const uint32_t section : open_sections_) {
    Bus& bus = *buses_[section / kSectionCount];
    if (bus.stop.target() == 0 && bus.stop.resting()) sections_[section]->section.Silence();
  }
  for (const uint32_t section : open_sections_) {
    Bus& bus = *buses_[section / kSectionCount];
    if (bus.stop.target() == 0 && bus.stop.resting()) bus.stop.JumpTo(1);
  }
}

}  // namespace carillon
