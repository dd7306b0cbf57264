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

/// Counts of one call of RenderSection::Render.
struct SectionCounts {
  uint64_t dropped_count = 0;
  uint64_t reset_bank_count = 0;
  uint64_t bounded_bank_count = 0;  ///< banks lowered because a mode exceeded kMostAmplitude
  uint64_t active_mode_count = 0;   ///< at the end
  double ringing_work = 0;          ///< units of work of the next block without events
  bool sounded = false;             ///< anything was rendered; if false, frames are unwritten
  bool placed = false;              ///< a voice was rendered
};

/// A share of a mixer's banks, rendered by one thread at a time; several sections may render at
/// once. Each section has its own stagger of long blocks (BlockMix), so that their work is spread
/// evenly.
class RenderSection {
 public:
  struct Settings {
    size_t block_frame_count = 0;
    size_t stagger = 0;
    size_t most_banks = 0;  ///< in this section
    float fade_step = 0;    ///< by which the gain of a fading bank falls per frame
    size_t channel_count = 1;
  };
  /// `slots` are all slots of the mixer; the section uses those of its own banks only.
  RenderSection(const Settings& settings, std::span<BankSlot> slots);

  /// Slots of the sounding banks.
  std::span<const uint32_t> sounding() const noexcept { return sounding_; }

  /// Destination of the rendered sound.
  struct Output {
    std::span<float> frames;  ///< banks without a voice: whole blocks, mono
    std::span<float> placed;  ///< voices: the same number of frames, interleaved
  };

  /// Renders as many blocks as `output` holds, from `block_number` on. `events` are those of this
  /// section, in RenderOrder. `output.frames` is written only if the returned counts say `sounded`,
  /// `output.placed` only if they say `placed`.
  SectionCounts Render(uint64_t block_number, std::span<const DueEvent> events,
                       const Output& output, RenderWorkspace& workspace) noexcept
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(kRenderRole);

  /// Ends all sound at once, including the sound that is still on its way to the listener.
  void Silence() noexcept ABSL_EXCLUSIVE_LOCKS_REQUIRED(kRenderRole);

 private:
  bool idle() const noexcept { return sounding_.empty() && voices_.empty() && mix_.idle(); }
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

  /// Computes the gains of a bank with directivity for the listener's bearing, once in a block.
  void SetGains(BankSlot& slot) noexcept;
  bool Move(Voice* voice, const MixerEvent& event, size_t offset) noexcept;
  void Wake(Voice& voice) noexcept;
  void RenderVoices(std::span<float> placed, SectionCounts& counts) noexcept;

  Settings settings_;
  std::span<BankSlot> slots_;
  FixedVector<uint32_t> sounding_;  // in order of awakening
  FixedVector<Voice*> voices_;      // those not asleep, in order of awakening
  BlockMix mix_;
};

}  // namespace carillon
