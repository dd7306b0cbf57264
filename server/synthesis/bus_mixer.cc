// SPDX-License-Identifier: Apache-2.0
#include "server/synthesis/bus_mixer.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "server/synthesis/frames.h"
#include "server/synthesis/voice/ambisonics.h"

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

bool IsToBeSilenced(const Bus& bus) noexcept {
  return bus.stop.target() == 0 && bus.stop.resting();
}

}  // namespace

BusMixer::BusMixer(const MixerSettings& settings, const Buses& buses, MixerCounters& counters)
    : sample_rate_hz_(settings.sample_rate_hz),
      block_frame_count_(settings.block_frame_count),
      channel_count_(settings.channel_count),
      buses_(buses),
      counters_(counters),
      sections_(settings.most_buses * kSectionCount),
      open_sections_(settings.most_buses * kSectionCount),
      gains_(kBlocksTogether * settings.block_frame_count),
      bus_frames_(gains_.size()),
      bus_placed_(gains_.size() * settings.channel_count),
      mixed_frames_(gains_.size()),
      mixed_placed_(bus_placed_.size()),
      master_(settings.sample_rate_hz, static_cast<float>(settings.gain)) {}

void BusMixer::Open(uint32_t number, MixedSection& section) noexcept {
  sections_[number] = &section;
  const bool is_first = std::ranges::none_of(open_sections_, [number](uint32_t other) {
    return BusOfSection(other) == BusOfSection(number);
  });
  if (is_first) {
    // No bank of the bus rings yet, so neither the gain nor a stop needs a glide.
    Bus& bus = BusOf(number);
    bus.fader.JumpTo(bus.gain.load(std::memory_order_relaxed));
    bus.stop_count = bus.stops_asked.load(std::memory_order_relaxed);
  }
  open_sections_.push_back(number);
  std::ranges::sort(open_sections_);
}

void BusMixer::ListenToControl(float master_gain) noexcept {
  master_.GlideTo(master_gain);
  const Bus* last = nullptr;
  for (const uint32_t section : open_sections_) {
    Bus& bus = BusOf(section);
    if (&bus != last) bus.Listen();
    last = &bus;
  }
}

void BusMixer::Mix(uint64_t first_frame, std::span<float> frames) noexcept {
  const size_t frame_count = frames.size() / channel_count_;
  const std::span<float> mixed = std::span(mixed_frames_).first(frame_count);
  const std::span<float> mixed_placed = std::span(mixed_placed_).first(frames.size());
  std::ranges::fill(mixed, 0.0F);
  std::ranges::fill(mixed_placed, 0.0F);
  active_mode_count_ = 0;
  ringing_work_ = 0;
  sounded_ = false;
  bool placed = false;
  for (auto first = open_sections_.begin(); first != open_sections_.end();) {
    const uint32_t bus = BusOfSection(*first);
    const auto last = std::find_if(first, open_sections_.end(), [bus](uint32_t section) {
      return BusOfSection(section) != bus;
    });
    placed |= MixBus(*buses_[bus], {first, last}, first_frame, frame_count);
    first = last;
  }
  counters_.active_mode_count.store(active_mode_count_, std::memory_order_relaxed);
  Spread(mixed_frames_, channel_count_, frames);
  if (placed) AddTo(mixed_placed_, frames);
  if (master_.neutral()) return;
  const std::span<float> gains = std::span(gains_).first(frame_count);
  std::ranges::fill(gains, 1.0F);
  master_.Multiply(gains);
  MultiplyFrames(gains, channel_count_, frames);
}

bool BusMixer::MixBus(Bus& bus, std::span<const uint32_t> sections, uint64_t first_frame,
                      size_t frame_count) noexcept {
  const bool placed = CountSections(bus, sections);
  LetPeakFall(bus, static_cast<double>(frame_count) / sample_rate_hz_);
  // Most buses of a daemon belong to scenes at rest, which should cost nothing.
  const bool heard = bus.listener.load(std::memory_order_relaxed) != nullptr;
  if (!bus.sounded && !heard && !bus.changes()) return false;
  frames_ = std::span(bus_frames_).first(frame_count);
  placed_ = std::span(bus_placed_).first(frame_count * channel_count_);
  AddSections(sections);
  ApplyGains(bus);
  LetHear(bus, first_frame);
  if (!bus.sounded) return false;
  float peak = LargestMagnitude(frames_);
  AddTo(frames_, std::span(mixed_frames_).first(frames_.size()));
  if (placed) {
    peak = std::max(peak, LargestMagnitude(placed_));
    AddTo(placed_, std::span(mixed_placed_).first(placed_.size()));
  }
  const float fallen = bus.peak.load(std::memory_order_relaxed);
  bus.peak.store(std::max(fallen, peak), std::memory_order_relaxed);
  return placed;
}

bool BusMixer::CountSections(Bus& bus, std::span<const uint32_t> sections) noexcept {
  bool placed = false;
  bus.sounded = false;
  uint64_t active_mode_count = 0;
  for (const uint32_t number : sections) {
    const SectionCounts& counts = sections_[number]->counts;
    Count(counters_.dropped_count, counts.dropped_count);
    Count(counters_.reset_bank_count, counts.reset_bank_count);
    Count(counters_.bounded_bank_count, counts.bounded_bank_count);
    ringing_work_ += counts.ringing_work;
    active_mode_count += counts.active_mode_count;
    bus.sounded |= counts.sounded;
    placed |= counts.placed;
  }
  sounded_ |= bus.sounded;
  active_mode_count_ += active_mode_count;
  bus.active_mode_count.store(active_mode_count, std::memory_order_relaxed);
  return placed;
}

void BusMixer::AddSections(std::span<const uint32_t> sections) noexcept {
  std::ranges::fill(frames_, 0.0F);
  std::ranges::fill(placed_, 0.0F);
  for (const uint32_t number : sections) {
    const MixedSection& section = *sections_[number];
    if (section.counts.sounded) AddTo(section.frames, frames_);
    if (section.counts.placed) AddTo(section.placed, placed_);
  }
}

void BusMixer::ApplyGains(Bus& bus) noexcept {
  if (bus.fader.neutral() && bus.stop.neutral()) return;
  const std::span<float> gains = std::span(gains_).first(frames_.size());
  std::ranges::fill(gains, 1.0F);
  bus.fader.Multiply(gains);
  bus.stop.Multiply(gains);
  MultiplyFrames(gains, 1, frames_);
  MultiplyFrames(gains, channel_count_, placed_);
}

void BusMixer::LetHear(const Bus& bus, uint64_t first_frame) noexcept {
  BusListener* const listener = bus.listener.load(std::memory_order_acquire);
  if (listener == nullptr) return;
  std::array<float, kMostChannels * kMostBlockFrames> heard;
  const std::span<float> block = std::span(heard).first(block_frame_count_ * channel_count_);
  for (size_t first = 0; first < frames_.size(); first += block_frame_count_) {
    Spread(frames_.subspan(first), channel_count_, block);
    AddTo(placed_.subspan(first * channel_count_), block);
    listener->Hear(first_frame + first, block);
  }
}

void BusMixer::EndStops() noexcept {
  for (const uint32_t section : open_sections_) {
    if (IsToBeSilenced(BusOf(section))) sections_[section]->section.Silence();
  }
  for (const uint32_t section : open_sections_) {
    if (Bus& bus = BusOf(section); IsToBeSilenced(bus)) bus.stop.JumpTo(1);
  }
}

}  // namespace carillon
