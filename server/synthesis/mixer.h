// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/status/statusor.h"
#include "server/base/fixed_vector.h"
#include "server/base/thread_role.h"
#include "server/synthesis/bank/oscillator_bank.h"
#include "server/synthesis/bank_owner.h"
#include "server/synthesis/bank_slot.h"
#include "server/synthesis/bus.h"
#include "server/synthesis/bus_mixer.h"
#include "server/synthesis/event_intake.h"
#include "server/synthesis/limiter.h"
#include "server/synthesis/mixer_settings.h"
#include "server/synthesis/mixer_statistics.h"
#include "server/synthesis/schedule/event_stream.h"
#include "server/synthesis/schedule/mixer_event.h"

namespace carillon {

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

  /// Renders the next frames, interleaved, within +-1 unless the settings leave the limiter out.
  /// `frames` holds whole blocks of block_frame_count.
  void Render(std::span<float> frames) noexcept;

  /// Does the same with a workspace that several mixers use one after the other. The mixer must
  /// have no threads.
  void Render(std::span<float> frames, RenderWorkspace& workspace) noexcept {
    workspace_ = &workspace;
    Render(frames);
  }

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
  static size_t Stagger(BusId bus) { return StaggerOf(bus); }

  /// Removes a bank once it is silent. The caller must send it no further events; events already
  /// sent still sound.
  void LetRingOut(BankId bank) ABSL_LOCKS_EXCLUDED(kRenderRole) { owner_.LetRingOut(bank); }

  /// Removes a bank after a fade of 10 ms. The fade begins when the bank's current long blocks have
  /// ended, within 2048 frames. Events already sent to the bank are lost.
  void FadeOut(BankId bank) ABSL_LOCKS_EXCLUDED(kRenderRole) { owner_.FadeOut(bank); }

  /// Opens a stream of events; `capacity` events may wait in it until the mixer takes them. Errors:
  /// ResourceExhausted (TOO_MANY_STREAMS).
  absl::StatusOr<std::unique_ptr<EventStream>> OpenStream(size_t capacity = 4096,
                                                          StreamKind kind = StreamKind::kTimely)
      ABSL_LOCKS_EXCLUDED(kRenderRole);

  /// Frees the banks, voices and queues that Render has retired. A housekeeping thread calls it
  /// periodically.
  void CollectGarbage() ABSL_LOCKS_EXCLUDED(kRenderRole) { owner_.CollectGarbage(); }

  /// Returns whether the last call of Render had nothing to do: nothing sounded, no event waits,
  /// and no contact stream was open.
  bool resting() const noexcept { return resting_.load(std::memory_order_relaxed); }

  /// Lets whoever pauses rendering begin again.
  void Wake() const {
    if (settings_.wake) settings_.wake();
  }

  /// Number of the next frame to be rendered.
  uint64_t frame() const noexcept { return counters_.frame_count.load(); }

  /// Each value is correct by itself; two values may belong to different blocks.
  MixerStatistics statistics() const noexcept { return counters_.Read(); }

  /// Number of modes on the mixer.
  size_t mode_count() const ABSL_LOCKS_EXCLUDED(kRenderRole) { return owner_.mode_count(); }

  /// The largest sample before the limiter since the last call.
  double TakePeak() noexcept { return peak_.exchange(0, std::memory_order_relaxed); }

  const MixerSettings& settings() const { return settings_; }

 private:
  // Only the rendering thread calls these functions.

  /// Renders whole blocks, at most kBlocksTogether.
  void RenderBlocks(std::span<float> frames) noexcept ABSL_EXCLUSIVE_LOCKS_REQUIRED(kRenderRole);
  void ExecuteCommands() noexcept ABSL_EXCLUSIVE_LOCKS_REQUIRED(kRenderRole);
  void Execute(const MixerCommand& command) noexcept ABSL_EXCLUSIVE_LOCKS_REQUIRED(kRenderRole);
  void AddBank(const MixerCommand& command) noexcept ABSL_EXCLUSIVE_LOCKS_REQUIRED(kRenderRole);
  void TakeEvents(size_t block_count) noexcept ABSL_EXCLUSIVE_LOCKS_REQUIRED(kRenderRole);
  void RenderSections(size_t frame_count) noexcept ABSL_EXCLUSIVE_LOCKS_REQUIRED(kRenderRole);
  void RenderOneSection(size_t thread, MixedSection& mixed, size_t frame_count) noexcept
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(kRenderRole);
  void RetireLeavingBanks() noexcept ABSL_EXCLUSIVE_LOCKS_REQUIRED(kRenderRole);
  void NotePeak(std::span<const float> block) noexcept;

  const MixerSettings settings_;
  MixerCounters counters_;
  std::atomic<float> peak_{0};
  std::atomic<bool> resting_{false};
  std::atomic<float> master_gain_;
  const Buses buses_;

  // The members that the rendering thread alone uses have its role.
  BankTable banks_ ABSL_GUARDED_BY(kRenderRole);
  BankOwner owner_;
  uint64_t block_start_ ABSL_GUARDED_BY(kRenderRole);
  // Slots of banks that are retired once they are silent.
  FixedVector<uint32_t> leaving_ ABSL_GUARDED_BY(kRenderRole);
  BusMixer bus_mixer_ ABSL_GUARDED_BY(kRenderRole);
  EventIntake intake_ ABSL_GUARDED_BY(kRenderRole);
  std::vector<RenderWorkspace> workspaces_ ABSL_GUARDED_BY(kRenderRole);  // one for each thread
  RenderWorkspace* workspace_ = nullptr;                                  // the caller's, if any
  Limiter limiter_ ABSL_GUARDED_BY(kRenderRole);
};

}  // namespace carillon
