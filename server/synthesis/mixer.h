// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
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
#include "server/synthesis/bank/level.h"
#include "server/synthesis/bank/oscillator_bank.h"
#include "server/synthesis/bank_slot.h"
#include "server/synthesis/bus.h"
#include "server/synthesis/fader.h"
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

/// Number of sections that the banks of one bus are spread over.
inline constexpr size_t kSectionCount = BlockMix::kStaggers;

/// Most buses of a mixer, the default one included: twice as many as there are scenes, because the
/// bus of a deleted scene is in use until its objects have faded out.
inline constexpr size_t kMostBuses = 1024;

/// Most blocks that each section renders before the next section begins, if the caller requests
/// several blocks at once.
inline constexpr size_t kBlocksTogether = 16;

/// Most impulses that wait for one block of a mixer with a clock, for each of its frames. To choose
/// their treatment takes about a quarter of the block, even if all are shed. Buses share these
/// places (see PendingEvents): one bus alone has 51 impulses a frame, 2.5 million a second.
inline constexpr size_t kMostImpulsesPerFrame = 64;

/// Most other events that wait for one block of such a mixer. One bus alone has 13,107, which is
/// enough to move 4096 objects, push them and end their step at once.
inline constexpr size_t kMostOthersPerBlock = 16384;

/// Bounds of a mixer, which allocates all its memory in its constructor.
struct MixerSettings {
  double sample_rate_hz = 48000;
  size_t block_frame_count = 128;  ///< at most kMostBlockFrames
  size_t channel_count = 1;        ///< or 2; a bank without a voice sounds equally on both
  uint64_t first_frame = 0;        ///< number of the first frame; a multiple of block_frame_count
  size_t most_banks = 8192;        ///< including those that ring out or fade
  size_t most_buses = kMostBuses;
  size_t stagger = 0;  ///< of the default bus; see Mixer::Stagger
  size_t most_streams = 2048;
  /// Events that wait for their block. Buses share these places: see PendingEvents.
  size_t most_pending_events = 262144;
  size_t most_events_per_block = 16384;  ///< taken from the streams; the rest wait there
  /// With a clock, the work of a block is bounded so that its deadline is kept. Events beyond
  /// kMostImpulsesPerFrame and kMostOthersPerBlock are dropped when they are taken. Beyond the
  /// bound the quietest impulses are merged, then shed, then the quietest banks are silenced.
  /// MixerStatistics counts all of these. Without a clock nothing is left out, and the sound
  /// depends on the events only. The clock must outlive the mixer.
  const Clock* clock = nullptr;
  double most_load = 0.7;  ///< fraction of real time that rendering may take
  double gain = 1;         ///< of all buses together, before the limiter
  /// The pressure of a sample of 1. The banks of the mixer are made for it.
  double full_scale_pa = kFullScalePa;
  /// Threads that render the sections in parallel. If it is null, the caller's thread renders them
  /// all. The sound is the same bit for bit. The threads must outlive the mixer.
  SectionThreads* threads = nullptr;
  /// Called by OpenStream before it returns, so that whoever pauses rendering begins again.
  std::function<void()> wake = nullptr;
};

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

/// The sound of a bus at this moment, in figures.
struct BusState {
  uint64_t active_mode_count = 0;  ///< modes that ring
  float peak = 0;                  ///< the largest sample of late; it falls by 40 dB a second
};

/// Renders all sounding objects into one stream of samples.
///
///     banks --> sections --> gain of a bus --+
///     banks --> sections --> gain of a bus --+--> gain of all --> limiter --> samples
///
/// Each bank belongs to a bus. The banks of a bus are spread over up to kSectionCount sections,
/// whose long blocks begin in different blocks, so that every block takes about the same work. A
/// bus sounds the same bit for bit whatever the other buses do, as long as no work is left out.
///
/// Threads: one thread at a time calls Render; any thread may call the other functions. Render does
/// not allocate, lock, log, throw or call the system. On one SIMD target the same events always
/// give the same samples bit for bit, regardless of how many blocks one call of Render covers.
class Mixer {
 public:
  explicit Mixer(const MixerSettings& settings = {});
  ~Mixer();
  Mixer(const Mixer&) = delete;
  Mixer& operator=(const Mixer&) = delete;

  /// Renders the next frames, interleaved, within +-1. `frames` holds whole blocks of
  /// block_frame_count.
  void Render(std::span<float> frames) noexcept;

  /// Puts a bank on the mixer; events may be sent to it when the call returns. With a `voice`,
  /// which serves one object, the bank is heard from the object's position and rings in the time
  /// domain; without one it is heard without a position. Bank and voice must have been made for
  /// this mixer's sample rate, block and channels. Errors: ResourceExhausted (TOO_MANY_OBJECTS).
  absl::StatusOr<BankId> Add(std::unique_ptr<OscillatorBank> bank,
                             std::shared_ptr<Voice> voice = nullptr, BusId bus = {})
      ABSL_LOCKS_EXCLUDED(kRenderRole);

  /// Opens a bus. Errors: ResourceExhausted (TOO_MANY_SCENES: the mixer has most_buses).
  absl::StatusOr<BusId> OpenBus(double gain = 1) ABSL_LOCKS_EXCLUDED(kRenderRole);

  /// Gives up a bus. No bank may be added to it after this call; its banks sound until they are
  /// removed.
  void CloseBus(BusId bus) ABSL_LOCKS_EXCLUDED(kRenderRole);

  /// Lets the gain of a bus, or of all, glide to a value of zero or more within 30 ms, without a
  /// click.
  void SetGain(BusId bus, double gain);
  void SetGain(double gain) { master_gain_ = static_cast<float>(gain); }
  double gain() const { return master_gain_; }

  /// Fades a bus out within 30 ms, and ends all that rings in it then. Impulses that came before
  /// the end of the fade are not heard any more; later ones sound. Sustained forces stay.
  void Stop(BusId bus);

  /// Lets `listener` hear a bus. If it is null, nobody hears the bus. The listener must live as
  /// long as the mixer.
  void Tap(BusId bus, BusListener* listener);

  BusState State(BusId bus) const;

  /// Returns the stagger of a bus, 0 to kSectionCount - 1, by which the beginnings of its long
  /// blocks are shifted against those of other buses. Two buses of the same stagger render the same
  /// events to the same bits.
  static size_t Stagger(BusId bus);

  /// Removes a bank once it is silent. The caller must send it no further events; events already
  /// sent still sound.
  void LetRingOut(BankId bank) ABSL_LOCKS_EXCLUDED(kRenderRole);

  /// Removes a bank after a fade of 10 ms. The fade begins when the bank's current long blocks have
  /// ended, within 2048 frames. Events already sent to the bank are lost.
  void FadeOut(BankId bank) ABSL_LOCKS_EXCLUDED(kRenderRole);

  /// Opens a stream of events; `capacity` events may wait in it until the mixer takes them. Errors:
  /// ResourceExhausted (TOO_MANY_STREAMS).
  absl::StatusOr<std::unique_ptr<EventStream>> OpenStream(size_t capacity = 4096,
                                                          StreamKind kind = StreamKind::kTimely)
      ABSL_LOCKS_EXCLUDED(kRenderRole);

  /// Frees the banks, voices and queues that Render has retired. A housekeeping thread calls it
  /// periodically.
  void CollectGarbage() ABSL_LOCKS_EXCLUDED(kRenderRole);

  /// Returns whether the last call of Render had nothing to do: nothing sounded, no event waits,
  /// and no contact stream was open.
  bool resting() const noexcept { return resting_.load(std::memory_order_relaxed); }

  /// Number of the next frame to be rendered.
  uint64_t frame() const noexcept { return statistics_.frame_count.load(); }

  /// Each value is correct by itself; two values may belong to different blocks.
  MixerStatistics statistics() const noexcept;

  /// Number of modes on the mixer.
  size_t mode_count() ABSL_LOCKS_EXCLUDED(kRenderRole);

  /// The largest sample before the limiter since the last call.
  double TakePeak() noexcept { return peak_.exchange(0, std::memory_order_relaxed); }

  const MixerSettings& settings() const { return settings_; }

 private:
  /// A message from a controlling thread to the rendering thread.
  struct Command {
    enum class Kind { kAddBank, kLetRingOut, kFadeOut, kAddStream } kind;
    BankId id{};
    OscillatorBank* bank = nullptr;
    Voice* voice = nullptr;
    uint32_t section = 0;
    MixedSection* opened = nullptr;  // that section, if this bank is the first that it ever has
    EventQueue* queue = nullptr;
  };
  /// A message back: Render no longer uses this bank's slot or this stream's queue.
  struct Retired {
    BankId id{};
    EventQueue* queue = nullptr;
  };
  /// A bank as the controlling threads see it.
  struct OwnedBank {
    std::unique_ptr<OscillatorBank> bank;
    std::shared_ptr<Voice> voice;
    uint32_t generation = 0;
    uint32_t section = 0;
    size_t mode_count = 0;
    bool leaving = false;
    bool fading = false;
  };
  /// A bus as the controlling threads see it.
  struct OwnedBus {
    std::array<size_t, kSectionCount> mode_counts{};  // of each section
    size_t bank_count = 0;
    bool open = false;
  };
  struct Counters {
    std::atomic<uint64_t> frame_count{0};
    std::atomic<uint64_t> accepted_count{0}, late_count{0}, dropped_count{0};
    std::atomic<uint64_t> merged_count{0}, shed_count{0}, shed_bank_count{0};
    std::atomic<uint64_t> reset_bank_count{0}, bounded_bank_count{0}, limited_frame_count{0};
    std::atomic<uint64_t> bank_count{0}, active_mode_count{0};
  };

  OwnedBank* Find(BankId id) ABSL_EXCLUSIVE_LOCKS_REQUIRED(control_mutex_);
  uint32_t ChooseSection(BusId bus) const ABSL_EXCLUSIVE_LOCKS_REQUIRED(control_mutex_);
  /// Makes the section of this number and returns it, or returns null if it was made before.
  MixedSection* MakeSection(uint32_t section) ABSL_EXCLUSIVE_LOCKS_REQUIRED(control_mutex_);
  void Send(const Command& command) ABSL_EXCLUSIVE_LOCKS_REQUIRED(control_mutex_);

  // Only the rendering thread calls and uses what follows.

  /// Renders whole blocks, at most kBlocksTogether.
  void RenderBlocks(std::span<float> frames) noexcept ABSL_EXCLUSIVE_LOCKS_REQUIRED(kRenderRole);
  void ExecuteCommands() noexcept ABSL_EXCLUSIVE_LOCKS_REQUIRED(kRenderRole);
  void Execute(const Command& command) noexcept ABSL_EXCLUSIVE_LOCKS_REQUIRED(kRenderRole);
  void TakeEvents(size_t block_count) noexcept ABSL_EXCLUSIVE_LOCKS_REQUIRED(kRenderRole);
  size_t TakeSome(EventQueue& queue, size_t most) noexcept
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(kRenderRole);
  /// Takes an event from a queue. A late event is moved to the beginning of the block.
  void Take(MixerEvent& event, EventQueue& queue) noexcept
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(kRenderRole);
  void CollectDueEvents(size_t block_count) noexcept ABSL_EXCLUSIVE_LOCKS_REQUIRED(kRenderRole);
  bool WasStopped(const MixerEvent& event, const BankSlot& slot, uint32_t stop_count) const noexcept
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(kRenderRole);
  bool IsStale(const MixerEvent& event, uint32_t stop_count) noexcept
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(kRenderRole);
  void ChooseEvents(uint32_t block, std::span<const uint32_t> due) noexcept
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(kRenderRole);
  uint64_t ShedBanks() noexcept ABSL_EXCLUSIVE_LOCKS_REQUIRED(kRenderRole);
  void DecideTreatment(std::span<const uint32_t> due) noexcept
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(kRenderRole);
  float LoudnessOf(const SurfaceImpulse& impulse, const BankSlot& slot) const noexcept
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(kRenderRole);
  double LoudestSquared(uint32_t slot) const noexcept ABSL_EXCLUSIVE_LOCKS_REQUIRED(kRenderRole);
  bool Await(MixerEvent& event, BankSlot& slot) noexcept ABSL_EXCLUSIVE_LOCKS_REQUIRED(kRenderRole);
  bool IsShedEarly(const MixerEvent& event, const BankSlot& slot) const noexcept
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(kRenderRole);
  void RenderOneSection(size_t thread, MixedSection& mixed, size_t frame_count) noexcept
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(kRenderRole);
  void RenderSections(size_t frame_count) noexcept ABSL_EXCLUSIVE_LOCKS_REQUIRED(kRenderRole);
  void OpenSection(uint32_t section, MixedSection* opened) noexcept
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(kRenderRole);
  void ListenToControl() noexcept ABSL_EXCLUSIVE_LOCKS_REQUIRED(kRenderRole);
  void MixBuses(std::span<float> frames) noexcept ABSL_EXCLUSIVE_LOCKS_REQUIRED(kRenderRole);
  /// Adds the sections' sound, in their order, to that of all buses. Returns whether a voice
  /// sounds on the bus.
  bool MixBus(uint32_t bus, std::span<const uint32_t> sections, size_t frame_count) noexcept
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(kRenderRole);
  void AddSections(std::span<const uint32_t> sections, size_t frame_count) noexcept
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(kRenderRole);
  void CountSection(const SectionCounts& counts) noexcept
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(kRenderRole);
  void ApplyGains(Bus& bus, size_t frame_count) noexcept ABSL_EXCLUSIVE_LOCKS_REQUIRED(kRenderRole);
  void LetHear(Bus& bus, size_t frame_count) noexcept ABSL_EXCLUSIVE_LOCKS_REQUIRED(kRenderRole);
  void EndStops() noexcept ABSL_EXCLUSIVE_LOCKS_REQUIRED(kRenderRole);
  void RetireLeavingBanks() noexcept ABSL_EXCLUSIVE_LOCKS_REQUIRED(kRenderRole);
  void SendBack(const Retired& retired) noexcept ABSL_EXCLUSIVE_LOCKS_REQUIRED(kRenderRole);
  bool NothingWaits() const noexcept ABSL_EXCLUSIVE_LOCKS_REQUIRED(kRenderRole);
  void NotePeak(std::span<const float> block) noexcept ABSL_EXCLUSIVE_LOCKS_REQUIRED(kRenderRole);
  BankSlot* FindSlot(BankId id) noexcept ABSL_EXCLUSIVE_LOCKS_REQUIRED(kRenderRole);

  const MixerSettings settings_;
  Counters statistics_;
  std::atomic<float> peak_{0};
  std::atomic<bool> resting_{false};
  std::atomic<float> master_gain_{1};
  const std::vector<std::unique_ptr<Bus>> buses_;

  Mutex control_mutex_;
  std::vector<OwnedBank> owned_ ABSL_GUARDED_BY(control_mutex_);
  std::vector<uint32_t> free_slots_ ABSL_GUARDED_BY(control_mutex_);
  std::vector<OwnedBus> owned_buses_ ABSL_GUARDED_BY(control_mutex_);
  std::vector<std::unique_ptr<MixedSection>> owned_sections_ ABSL_GUARDED_BY(control_mutex_);
  std::vector<std::shared_ptr<EventQueue>> queues_ ABSL_GUARDED_BY(control_mutex_);
  SpscQueue<Command> commands_;  // produced under control_mutex_
  SpscQueue<Retired> retired_;   // consumed under control_mutex_

  uint64_t block_start_ ABSL_GUARDED_BY(kRenderRole);
  std::vector<BankSlot> slots_ ABSL_GUARDED_BY(kRenderRole);
  // The same slots, for sections that are made while others are rendered, and read them later.
  const std::span<BankSlot> slots_of_sections_;
  // Slots of banks that are retired once they are silent.
  FixedVector<uint32_t> leaving_ ABSL_GUARDED_BY(kRenderRole);
  FixedVector<EventQueue*> open_queues_ ABSL_GUARDED_BY(kRenderRole);
  // True: every event pushed before the commands of this block has been taken, so no event is on
  // its way to a bank that was let ring out, and it may be retired.
  bool all_events_taken_ ABSL_GUARDED_BY(kRenderRole) = true;
  std::array<MixerEvent, 64> taken_ ABSL_GUARDED_BY(kRenderRole){};
  PendingEvents pending_ ABSL_GUARDED_BY(kRenderRole);
  // Indices in pending_ of the events that are due in the blocks that one RenderBlocks renders.
  FixedVector<uint32_t> due_ ABSL_GUARDED_BY(kRenderRole);
  FixedVector<RenderOrder> due_order_ ABSL_GUARDED_BY(kRenderRole);
  FixedVector<DueEvent> due_events_ ABSL_GUARDED_BY(kRenderRole);
  LoudnessTriage triage_ ABSL_GUARDED_BY(kRenderRole);
  WorkBudget budget_ ABSL_GUARDED_BY(kRenderRole);
  // Quieter impulses are shed on arrival; zero: none is.
  float early_shed_below_ ABSL_GUARDED_BY(kRenderRole) = 0;
  // Number of events taken for the blocks that one RenderBlocks renders.
  size_t taken_count_ ABSL_GUARDED_BY(kRenderRole) = 0;
  // Work of the sounding banks in the next block.
  double ringing_work_ ABSL_GUARDED_BY(kRenderRole) = 0;
  // Work of the blocks that one RenderBlocks renders.
  double rendered_work_ ABSL_GUARDED_BY(kRenderRole) = 0;
  std::vector<MixedSection*> sections_ ABSL_GUARDED_BY(kRenderRole);  // null: not made yet
  // Numbers of the sections that were made, ascending: the sections of a bus are neighbours.
  FixedVector<uint32_t> open_sections_ ABSL_GUARDED_BY(kRenderRole);
  uint64_t active_mode_count_ ABSL_GUARDED_BY(kRenderRole) = 0;
  // A bus's gains and sound, and the sound of all buses, in the blocks of one RenderBlocks.
  std::vector<float> gains_ ABSL_GUARDED_BY(kRenderRole);
  std::vector<float> bus_frames_ ABSL_GUARDED_BY(kRenderRole);            // mono
  std::vector<float> bus_placed_ ABSL_GUARDED_BY(kRenderRole);            // interleaved
  std::vector<float> mixed_frames_ ABSL_GUARDED_BY(kRenderRole);          // mono
  std::vector<float> mixed_placed_ ABSL_GUARDED_BY(kRenderRole);          // interleaved
  std::vector<RenderWorkspace> workspaces_ ABSL_GUARDED_BY(kRenderRole);  // one for each thread
  Fader master_ ABSL_GUARDED_BY(kRenderRole);
  Limiter limiter_ ABSL_GUARDED_BY(kRenderRole);
};

}  // namespace carillon
