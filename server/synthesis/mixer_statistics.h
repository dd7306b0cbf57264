// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>

namespace carillon {

/// Counts since the mixer was made, and its present state.
struct MixerStatistics {
  uint64_t frame_count = 0;          ///< number of the next frame to be rendered
  uint64_t accepted_count = 0;       ///< impulses that came in time
  uint64_t late_count = 0;           ///< impulses that came too late and sounded at once
  uint64_t dropped_count = 0;        ///< events lost: bank gone, too many, or not finite
  uint64_t merged_count = 0;         ///< impulses merged with their neighbours
  uint64_t shed_count = 0;           ///< impulses not rendered: the quietest of too many
  uint64_t shed_bank_count = 0;      ///< banks silenced: the quietest of too many
  uint64_t reset_bank_count = 0;     ///< banks silenced because their state was not finite
  uint64_t bounded_bank_count = 0;   ///< blocks in which a bank was lowered: kMostAmplitude
  uint64_t limited_frame_count = 0;  ///< frames that the limiter changed
  uint64_t bank_count = 0;           ///< banks on the mixer
  uint64_t active_mode_count = 0;    ///< modes that ring
};

/// The counters behind MixerStatistics. Only the rendering thread writes them.
struct MixerCounters {
  std::atomic<uint64_t> frame_count{0};
  std::atomic<uint64_t> accepted_count{0}, late_count{0}, dropped_count{0};
  std::atomic<uint64_t> merged_count{0}, shed_count{0}, shed_bank_count{0};
  std::atomic<uint64_t> reset_bank_count{0}, bounded_bank_count{0}, limited_frame_count{0};
  std::atomic<uint64_t> bank_count{0}, active_mode_count{0};

  MixerStatistics Read() const noexcept {
    return {.frame_count = frame_count,
            .accepted_count = accepted_count,
            .late_count = late_count,
            .dropped_count = dropped_count,
            .merged_count = merged_count,
            .shed_count = shed_count,
            .shed_bank_count = shed_bank_count,
            .reset_bank_count = reset_bank_count,
            .bounded_bank_count = bounded_bank_count,
            .limited_frame_count = limited_frame_count,
            .bank_count = bank_count,
            .active_mode_count = active_mode_count};
  }
};

/// Adds to a counter that only this thread writes.
inline void Count(std::atomic<uint64_t>& counter, uint64_t more = 1) noexcept {
  counter.store(counter.load(std::memory_order_relaxed) + more, std::memory_order_relaxed);
}

}  // namespace carillon
