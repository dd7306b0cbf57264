// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/status/statusor.h"
#include "server/base/clock.h"
#include "server/base/fixed_vector.h"
#include "server/base/mutex.h"
#include "server/base/spsc_queue.h"
#include "server/base/thread_role.h"
#include "server/synthesis/bank/block_mix.h"
#include "server/synthesis/bank/oscillator_bank.h"
#include "server/synthesis/bank_slot.h"
#include "server/synthesis/limiter.h"
#include "server/synthesis/render_section.h"
#include "server/synthesis/render_threads.h"
#include "server/synthesis/schedule/event_stream.h"
#include "server/synthesis/schedule/loudness_triage.h"
#include "server/synthesis/schedule/mixer_event.h"
#include "server/synthesis/schedule/pending_events.h"
#include "server/synthesis/schedule/render_order.h"
#include "server/synthesis/schedule/work_budget.h"

namespace carillon {

/// Parts that a mixer's banks are spread over.
inline constexpr size_t kSectionCount = BlockMix::kStaggers;

/// Blocks that are rendered in one go where the caller asks for as many: each section renders all
/// of them before the next does.
inline constexpr size_t kBlocksTogether = 16;

/// Bounds of a mixer; all memory is taken when it is made.
struct MixerSettings {
  double sample_rate_hz = 48000;
  size_t block_frame_count = 128;  ///< at most kMostBlockFrames
  size_t channel_count = 1;        ///< or 2: what has no voice sounds on both alike
  uint64_t first_frame = 0;        ///< number of the first; a multiple of block_frame_count
  size_t most_banks = 8192;        ///< those that ring out or fade included
  size_t most_streams = 1024;
  size_t most_pending_events = 262144;   ///< waiting for their time
  size_t most_events_per_block = 32768;  ///< taken from the streams; further ones wait there
  /// Where there is a clock, a block's work is bounded, so that its deadline is kept: beyond it the
  /// least audible strikes are merged, then shed, then banks; see MixerStatistics. Without one
  /// nothing is, and the sound depends on nothing but what was asked for. It must outlive the
  /// mixer.
  const Clock* clock = nullptr;
  double most_load = 0.7;  ///< part of real time
  /// Who renders the sections; none: the caller alone. The sound is the same, bit for bit. It must
  /// outlive the mixer.
  SectionThreads* threads = nullptr;
};

/// What a mixer has counted since it was made, and what it renders now.
struct MixerStatistics {
  uint64_t frame_count = 0;          ///< rendered
  uint64_t accepted_count = 0;       ///< strikes that came in time
  uint64_t late_count = 0;           ///< strikes that came too late and sounded at once
  uint64_t dropped_count = 0;        ///< strikes lost: no such bank, too many, or not finite
  uint64_t merged_count = 0;         ///< accepted strikes that were merged with their neighbours
  uint64_t shed_count = 0;           ///< accepted strikes shed: the least audible of too many
  uint64_t shed_bank_count = 0;      ///< banks silenced: the least audible of too many
  uint64_t reset_bank_count = 0;     ///< banks silenced because their state was not finite
  uint64_t limited_frame_count = 0;  ///< frames in which the limiter worked
  uint64_t bank_count = 0;           ///< on the mixer
  uint64_t active_mode_count = 0;    ///< ringing
};

/// Renders all sounding objects into one stream of samples.
///
/// Banks are spread over kSectionCount sections, whose long blocks begin in different blocks, so
/// that the work is even.
///
/// Threads: one at a time calls Render; any may call the rest. Nothing under Render allocates,
/// locks, logs, throws or calls the system. The same strikes sound bit for bit the same on one SIMD
/// target, however many blocks one call of Render covers.
class Mixer {
 public:
  explicit Mixer(const MixerSettings& settings = {});
  ~Mixer();
  Mixer(const Mixer&) = delete;
  Mixer& operator=(const Mixer&) = delete;

  /// Renders the next frames, interleaved, within +-1. `frames` holds whole blocks of
  /// block_frame_count.
  void Render(std::span<float> frames) noexcept;

  /// Puts a bank on the mixer; it can be struck when the call returns. The bank was made for this
  /// mixer's sample rate, block and channels, and so was the voice through which it is heard, which
  /// serves one object; without one it is heard as it is. A bank with a voice rings in the time
  /// domain. RESOURCE_EXHAUSTED (TOO_MANY_OBJECTS).
  absl::StatusOr<BankId> Add(std::unique_ptr<OscillatorBank> bank,
                             std::shared_ptr<Voice> voice = nullptr)
      ABSL_LOCKS_EXCLUDED(kRenderRole);

  /// Takes a bank off once it is silent. The caller sends it no further strikes; those on their way
  /// still sound.
  void LetRingOut(BankId bank) ABSL_LOCKS_EXCLUDED(kRenderRole);

  /// Takes a bank off after a fade of 10 ms, which begins when its long blocks under way have
  /// ended, within 2048 frames; strikes on their way to it are lost.
  void FadeOut(BankId bank) ABSL_LOCKS_EXCLUDED(kRenderRole);

  /// A new stream of strikes, of which `capacity` may wait to be taken.
  /// RESOURCE_EXHAUSTED (TOO_MANY_STREAMS).
  absl::StatusOr<std::unique_ptr<EventStream>> OpenStream(size_t capacity = 4096)
      ABSL_LOCKS_EXCLUDED(kRenderRole);

  /// Frees what Render has retired; a housekeeping thread calls it now and then.
  void CollectGarbage() ABSL_LOCKS_EXCLUDED(kRenderRole);

  /// Number of the next frame to be rendered.
  uint64_t frame() const noexcept { return statistics_.frame_count.load(); }

  /// Each figure is right by itself; together they may straddle a block.
  MixerStatistics statistics() const noexcept;

  /// The largest sample before the limiter since the last call.
  double TakePeak() noexcept { return peak_.exchange(0, std::memory_order_relaxed); }

  const MixerSettings& settings() const { return settings_; }

 private:
  /// From the controlling threads to the rendering one.
  struct Command {
    enum class Kind { kAddBank, kLetRingOut, kFadeOut, kAddStream } kind;
    BankId id{};
    OscillatorBank* bank = nullptr;
    Voice* voice = nullptr;
    uint32_t section = 0;
    EventQueue* queue = nullptr;
  };
  /// Back: a bank's slot, or a stream's queue, that Render holds no longer.
  struct Retired {
    BankId id{};
    EventQueue* queue = nullptr;
  };
  /// A place for a bank as the controlling threads see it.
  struct OwnedBank {
    std::unique_ptr<OscillatorBank> bank;
    std::shared_ptr<Voice> voice;
    uint32_t generation = 0;
    uint32_t section = 0;
    size_t mode_count = 0;
    bool leaving = false;
    bool fading = false;
  };
  struct Counters {
    std::atomic<uint64_t> frame_count{0};
    std::atomic<uint64_t> accepted_count{0}, late_count{0}, dropped_count{0};
    std::atomic<uint64_t> merged_count{0}, shed_count{0}, shed_bank_count{0};
    std::atomic<uint64_t> reset_bank_count{0}, limited_frame_count{0};
    std::atomic<uint64_t> bank_count{0}, active_mode_count{0};
  };

  OwnedBank* Find(BankId id) ABSL_EXCLUSIVE_LOCKS_REQUIRED(control_mutex_);
  uint32_t ChooseSection() const ABSL_EXCLUSIVE_LOCKS_REQUIRED(control_mutex_);
  void Send(const Command& command) ABSL_EXCLUSIVE_LOCKS_REQUIRED(control_mutex_);

  // The rest is the rendering thread's.
  void RenderBlocks(std::span<float> frames) noexcept ABSL_EXCLUSIVE_LOCKS_REQUIRED(kRenderRole);
  void ObeyCommands() noexcept ABSL_EXCLUSIVE_LOCKS_REQUIRED(kRenderRole);
  void Obey(const Command& command) noexcept ABSL_EXCLUSIVE_LOCKS_REQUIRED(kRenderRole);
  void TakeEvents(size_t block_count) noexcept ABSL_EXCLUSIVE_LOCKS_REQUIRED(kRenderRole);
  void Take(MixerEvent event, EventQueue& queue) noexcept
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(kRenderRole);
  void CollectDueEvents(size_t block_count) noexcept ABSL_EXCLUSIVE_LOCKS_REQUIRED(kRenderRole);
  void ChooseEvents(uint32_t block, std::span<const uint32_t> due) noexcept
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(kRenderRole);
  void ShedBanks() noexcept ABSL_EXCLUSIVE_LOCKS_REQUIRED(kRenderRole);
  void DecideTreatment(std::span<const uint32_t> due) noexcept
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(kRenderRole);
  static float LoudnessOf(const SurfaceImpulse& impulse, const BankSlot& slot) noexcept
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(kRenderRole);
  bool IsHopeless(const MixerEvent& event, const BankSlot& slot) const noexcept
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(kRenderRole);
  void RenderOneSection(size_t worker, size_t section, size_t frame_count) noexcept
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(kRenderRole);
  void RenderSections(std::span<float> frames) noexcept ABSL_EXCLUSIVE_LOCKS_REQUIRED(kRenderRole);
  void MixSections(std::span<float> frames) noexcept ABSL_EXCLUSIVE_LOCKS_REQUIRED(kRenderRole);
  void RetireLeavingBanks() noexcept ABSL_EXCLUSIVE_LOCKS_REQUIRED(kRenderRole);
  void SendBack(const Retired& retired) noexcept ABSL_EXCLUSIVE_LOCKS_REQUIRED(kRenderRole);
  void NotePeak(std::span<const float> block) noexcept ABSL_EXCLUSIVE_LOCKS_REQUIRED(kRenderRole);
  BankSlot* FindSlot(BankId id) noexcept ABSL_EXCLUSIVE_LOCKS_REQUIRED(kRenderRole);

  const MixerSettings settings_;
  Counters statistics_;
  std::atomic<float> peak_{0};

  Mutex control_mutex_;
  std::vector<OwnedBank> owned_ ABSL_GUARDED_BY(control_mutex_);
  std::vector<uint32_t> free_slots_ ABSL_GUARDED_BY(control_mutex_);
  std::array<size_t, kSectionCount> section_mode_counts_ ABSL_GUARDED_BY(control_mutex_){};
  std::vector<std::shared_ptr<EventQueue>> queues_ ABSL_GUARDED_BY(control_mutex_);
  SpscQueue<Command> commands_;  // produced under control_mutex_
  SpscQueue<Retired> retired_;   // consumed under control_mutex_

  uint64_t block_start_ ABSL_GUARDED_BY(kRenderRole);
  std::vector<BankSlot> slots_ ABSL_GUARDED_BY(kRenderRole);
  // Slots to be retired when they are silent.
  FixedVector<uint32_t> leaving_ ABSL_GUARDED_BY(kRenderRole);
  FixedVector<EventQueue*> open_queues_ ABSL_GUARDED_BY(kRenderRole);
  // All that was pushed before the commands of this block were given: a bank let ring out may be
  // retired, for no strike is on its way to it.
  bool all_events_taken_ ABSL_GUARDED_BY(kRenderRole) = true;
  std::array<MixerEvent, 64> taken_ ABSL_GUARDED_BY(kRenderRole){};
  PendingEvents pending_ ABSL_GUARDED_BY(kRenderRole);
  // Of the blocks rendered together: places in pending_.
  FixedVector<uint32_t> due_ ABSL_GUARDED_BY(kRenderRole);
  // See ChooseEvents.
  FixedVector<RenderOrder> due_order_ ABSL_GUARDED_BY(kRenderRole);
  FixedVector<DueEvent> due_events_ ABSL_GUARDED_BY(kRenderRole);
  // Of each section, in due_events_.
  std::array<size_t, kSectionCount + 1> due_ends_ ABSL_GUARDED_BY(kRenderRole){};
  LoudnessTriage triage_ ABSL_GUARDED_BY(kRenderRole);
  WorkBudget budget_ ABSL_GUARDED_BY(kRenderRole);
  // Loudness.
  float hopeless_below_ ABSL_GUARDED_BY(kRenderRole) = 0;
  // Strikes, for the blocks rendered together.
  size_t taken_count_ ABSL_GUARDED_BY(kRenderRole) = 0;
  // Of the sounding banks, in the next block.
  double ringing_work_ ABSL_GUARDED_BY(kRenderRole) = 0;
  // Of the blocks rendered together.
  double rendered_work_ ABSL_GUARDED_BY(kRenderRole) = 0;
  std::vector<RenderSection> sections_ ABSL_GUARDED_BY(kRenderRole);
  std::array<SectionCounts, kSectionCount> section_counts_ ABSL_GUARDED_BY(kRenderRole){};
  std::vector<float> section_frames_ ABSL_GUARDED_BY(kRenderRole);
  std::vector<float> placed_frames_ ABSL_GUARDED_BY(kRenderRole);
  std::vector<float> mixed_frames_ ABSL_GUARDED_BY(kRenderRole);          // mono
  std::vector<RenderWorkspace> workspaces_ ABSL_GUARDED_BY(kRenderRole);  // one for each thread
  Limiter limiter_ ABSL_GUARDED_BY(kRenderRole);
};

}  // namespace carillon
