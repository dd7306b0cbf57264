// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "server/base/fixed_vector.h"
#include "server/base/thread_role.h"
#include "server/synthesis/bus.h"
#include "server/synthesis/fader.h"
#include "server/synthesis/mixer_settings.h"
#include "server/synthesis/mixer_statistics.h"

namespace carillon {

/// The buses of a mixer.
using Buses = std::vector<std::unique_ptr<Bus>>;

/// Returns the number of the bus to which a section belongs.
inline uint32_t BusOfSection(uint32_t section) {
  return section / static_cast<uint32_t>(kSectionCount);
}

/// Adds up the sections of each bus, and the buses, each times its gain. Only the rendering thread
/// uses it after its construction: nothing here allocates, locks, logs, throws or calls the system.
class BusMixer {
 public:
  /// `buses` and `counters` must outlive this.
  BusMixer(const MixerSettings& settings, const Buses& buses, MixerCounters& counters);

  /// Takes a section in that was made.
  void Open(uint32_t number, MixedSection& section) noexcept;

  /// Numbers of the sections that were opened, ascending: the sections of a bus are neighbours.
  std::span<const uint32_t> open_sections() const noexcept { return open_sections_; }
  MixedSection& section(uint32_t number) noexcept { return *sections_[number]; }
  const Bus& bus(uint32_t index) const noexcept { return *buses_[index]; }

  /// Takes over the gains and the stops that the controlling threads have set.
  void ListenToControl(float master_gain) noexcept;

  /// Mixes what the sections have rendered into `frames`, interleaved, from `first_frame` on.
  void Mix(uint64_t first_frame, std::span<float> frames) noexcept;

  /// Silences the buses that have faded out, and gives them their gain back.
  void EndStops() noexcept ABSL_EXCLUSIVE_LOCKS_REQUIRED(kRenderRole);

  /// Returns the work of the sounding banks in the next block.
  double ringing_work() const noexcept { return ringing_work_; }

  /// Returns whether any section sounded when it was mixed last.
  bool sounded() const noexcept { return sounded_; }

 private:
  Bus& BusOf(uint32_t section) noexcept { return *buses_[BusOfSection(section)]; }
  /// Adds the sections' sound, in their order, to that of all buses. Returns whether a voice
  /// sounds on the bus.
  bool MixBus(Bus& bus, std::span<const uint32_t> sections, uint64_t first_frame,
              size_t frame_count) noexcept;
  /// Adds up the counts of a bus's sections. Returns whether a voice sounds on the bus.
  bool CountSections(Bus& bus, std::span<const uint32_t> sections) noexcept;
  void AddSections(std::span<const uint32_t> sections) noexcept;
  void ApplyGains(Bus& bus) noexcept;
  void LetHear(const Bus& bus, uint64_t first_frame) noexcept;

  const double sample_rate_hz_;
  const size_t block_frame_count_;
  const size_t channel_count_;
  const Buses& buses_;
  MixerCounters& counters_;
  std::vector<MixedSection*> sections_;  // null: not made yet
  FixedVector<uint32_t> open_sections_;
  uint64_t active_mode_count_ = 0;
  double ringing_work_ = 0;
  bool sounded_ = false;
  // A bus's gains and sound, and the sound of all buses, in the blocks that are mixed together.
  std::vector<float> gains_, bus_frames_, bus_placed_, mixed_frames_, mixed_placed_;
  std::span<float> frames_, placed_;  // the parts of bus_frames_ and bus_placed_ in use
  Fader master_;
};

}  // namespace carillon
