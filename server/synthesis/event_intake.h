// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "absl/base/thread_annotations.h"
#include "absl/functional/function_ref.h"
#include "server/base/fixed_vector.h"
#include "server/base/thread_role.h"
#include "server/synthesis/bank_slot.h"
#include "server/synthesis/bus_mixer.h"
#include "server/synthesis/mixer_settings.h"
#include "server/synthesis/mixer_statistics.h"
#include "server/synthesis/schedule/event_stream.h"
#include "server/synthesis/schedule/loudness_triage.h"
#include "server/synthesis/schedule/mixer_event.h"
#include "server/synthesis/schedule/pending_events.h"
#include "server/synthesis/schedule/render_order.h"
#include "server/synthesis/schedule/work_budget.h"

namespace carillon {

/// Takes the events of all streams, keeps them until they are due, and gives each section those of
/// the next blocks in the order of rendering. With a clock, it chooses which impulses are merged or
/// shed, and which banks are silenced, so that each block is rendered in time. Only the rendering
/// thread uses it after its construction: nothing here allocates, locks, logs, throws or calls the
/// system.
class EventIntake {
 public:
  /// All arguments but the settings must outlive this.
  EventIntake(const MixerSettings& settings, BankTable& banks, BusMixer& buses,
              MixerCounters& counters);

  void Open(EventQueue& queue) noexcept { open_queues_.push_back(&queue); }

  /// Begins to measure the time that rendering takes; End ends that.
  void Begin() noexcept { budget_.Begin(); }

  /// Takes the events for the next `block_count` blocks. `execute_commands` is called if a bank may
  /// have been added, and have got events, since the commands of these blocks were executed. Calls
  /// `retire` with each queue that is closed and empty.
  void Take(uint64_t block_start, size_t block_count, absl::FunctionRef<void()> execute_commands,
            absl::FunctionRef<void(EventQueue&)> retire) noexcept;

  /// Gives the events that are due in these blocks to their sections.
  void CollectDue(size_t block_count) noexcept ABSL_EXCLUSIVE_LOCKS_REQUIRED(kRenderRole);

  /// Ends the blocks. Their events are not used any more.
  void End(size_t block_count) noexcept;

  /// Returns whether every event that was pushed before the commands of these blocks has been
  /// taken, so that no event is on its way to a bank that was let ring out.
  bool all_taken() const noexcept { return all_taken_; }

  /// Returns whether no event waits, and no stream is open that carries contacts.
  bool idle() const noexcept;

 private:
  /// Takes up to `most` events from a queue, and returns their number.
  size_t TakeSome(EventQueue& queue, size_t most,
                  absl::FunctionRef<void()> execute_commands) noexcept;
  /// Takes an event from a queue. A late event is moved to the beginning of the block.
  void TakeOne(MixerEvent& event, EventQueue& queue,
               absl::FunctionRef<void()> execute_commands) noexcept;
  /// Keeps an event until its block, and the start of its contact if the bank sounds from then on.
  /// False: there are too many, in all or in its block, or too many on its bus.
  bool Await(MixerEvent& event, BankSlot& slot) noexcept;
  bool Keep(const MixerEvent& event, BankSlot& slot) noexcept;
  /// Whether a bus that was stopped after the event came leaves it out: an impulse, or its
  /// beginning.
  bool WasStopped(const MixerEvent& event, const BankSlot& slot,
                  uint32_t stop_count) const noexcept;
  /// Whether an event will have no effect, because its bank has gone or its bus was stopped. Such
  /// an event gives its place to others before it is due.
  bool IsStale(const MixerEvent& event, uint32_t stop_count) noexcept;
  /// Decides which of a block's events are rendered, and notes their places in the order of
  /// rendering.
  void Choose(uint32_t block, std::span<const uint32_t> due) noexcept;
  Treatment TreatmentOf(const SurfaceImpulse* impulse, const BankSlot& slot) const noexcept;
  /// Gives each section its events in the order of rendering.
  void GiveToSections() noexcept;

  /// Whether an impulse is so quiet that keeping and judging it would be a waste.
  bool IsShedEarly(const MixerEvent& event, const BankSlot& slot) const noexcept;
  /// Decides which impulses of a block are exact, merged or shed.
  void DecideTreatment(std::span<const uint32_t> due) noexcept;
  /// Silences the quietest banks until the rest can be rendered in time. Returns their number.
  uint64_t ShedBanks() noexcept ABSL_EXCLUSIVE_LOCKS_REQUIRED(kRenderRole);
  float LoudnessOf(const SurfaceImpulse& impulse, const BankSlot& slot) const noexcept;
  double LoudestSquared(uint32_t slot) const noexcept;

  const size_t block_frame_count_;
  const size_t most_events_per_block_;
  BankTable& banks_;
  BusMixer& buses_;
  MixerCounters& counters_;
  FixedVector<EventQueue*> open_queues_;
  bool all_taken_ = true;
  std::array<MixerEvent, 64> taken_{};
  PendingEvents pending_;
  uint64_t block_start_ = 0;   // of the first of the blocks that are rendered together
  FixedVector<uint32_t> due_;  // indices in pending_ of the events due in these blocks
  FixedVector<RenderOrder> due_order_;
  FixedVector<DueEvent> due_events_;
  LoudnessTriage triage_;
  WorkBudget budget_;
  float early_shed_below_ = 0;  // quieter impulses are shed on arrival; zero: none is
  size_t taken_count_ = 0;      // events taken whose work is not in rendered_work_ yet
  double ringing_work_ = 0;     // work of the sounding banks in each of these blocks
  double rendered_work_ = 0;    // work of these blocks
};

}  // namespace carillon
