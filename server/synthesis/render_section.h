// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "absl/base/thread_annotations.h"
#include "server/base/fixed_vector.h"
#include "server/base/thread_role.h"
#include "server/synthesis/bank/block_mix.h"
#include "server/synthesis/bank_slot.h"
#include "server/synthesis/schedule/due_event.h"

namespace carillon {

/// What a section has counted while rendering.
struct SectionCounts {
  uint64_t dropped_count = 0;
  uint64_t reset_bank_count = 0;
  uint64_t active_mode_count = 0;  ///< now
  double ringing_work = 0;  ///< units (work_budget.h) that the next block takes without strikes
  bool placed = false;      ///< something was heard through a voice
};

/// Some of a mixer's banks, which one thread renders together; several sections may render at once.
/// Long blocks begin in another block in each, so that their work is spread evenly.
class RenderSection {
 public:
  struct Settings {
    size_t block_frame_count = 0;
    size_t stagger = 0;     ///< see BlockMix
    size_t most_banks = 0;  ///< in this section
    float fade_step = 0;    ///< of a fading bank's gain in a frame
    size_t channel_count = 1;
  };
  /// `slots` belong to the mixer; this section touches its own only.
  RenderSection(const Settings& settings, std::span<BankSlot> slots);

  /// Its sounding banks' slots.
  std::span<const uint32_t> sounding() const noexcept { return sounding_; }

  /// Where it renders to.
  struct Output {
    std::span<float> frames;  ///< what is heard as it is: whole blocks, mono
    std::span<float> placed;  ///< what is heard through voices: as many, interleaved
  };

  /// Renders blocks, the first of which has this number. `events` are this section's, ascending by
  /// block, then slot, then offset. Where the counts say that nothing was placed, `placed` is
  /// untouched.
  SectionCounts Render(uint64_t block_number, std::span<const DueEvent> events,
                       const Output& output, RenderWorkspace& workspace) noexcept
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(kRenderRole);

 private:
  void Execute(std::span<const DueEvent> events, SectionCounts& counts) noexcept
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(kRenderRole);
  bool Apply(BankSlot& slot, std::span<const DueEvent> due) noexcept
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(kRenderRole);
  void RenderBank(BankSlot& slot, SectionCounts& counts) noexcept
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(kRenderRole);
  void RenderFading(BankSlot& slot, std::span<float> block, SectionCounts& counts) noexcept
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(kRenderRole);
  void FinishBanks(std::span<float> block, SectionCounts& counts) noexcept
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(kRenderRole);

  bool Move(Voice* voice, const MixerEvent& event, size_t offset) noexcept;
  void Awake(Voice& voice) noexcept;
  void RenderVoices(std::span<float> placed, SectionCounts& counts) noexcept;

  Settings settings_;
  std::span<BankSlot> slots_;
  FixedVector<uint32_t> sounding_;  // slots whose banks are not silent, in order of their awakening
  FixedVector<Voice*> voices_;      // that are not asleep, in order of their awakening
  BlockMix mix_;
};

}  // namespace carillon
