// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/status/statusor.h"
#include "server/base/mutex.h"
#include "server/base/spsc_queue.h"
#include "server/base/thread_role.h"
#include "server/synthesis/bus.h"
#include "server/synthesis/mixer_settings.h"
#include "server/synthesis/schedule/event_stream.h"

namespace carillon {

/// A message from a controlling thread to the rendering thread.
struct MixerCommand {
  enum class Kind { kAddBank, kLetRingOut, kFadeOut, kAddStream } kind;
  BankId id{};
  OscillatorBank* bank = nullptr;
  Voice* voice = nullptr;
  uint32_t section = 0;
  MixedSection* opened = nullptr;  ///< that section, if this bank is the first that it ever has
  EventQueue* queue = nullptr;
};

/// A message back: the rendering thread no longer uses this bank's slot or this stream's queue.
struct MixerRetired {
  BankId id{};
  EventQueue* queue = nullptr;
};

/// Owns the banks, voices, sections and event queues of a mixer for the controlling threads, and
/// hands them to the rendering thread by commands. Any thread but the rendering thread may call the
/// functions that lock; see Mixer for what they do.
class BankOwner {
 public:
  /// `slots` are those of the mixer.
  BankOwner(const MixerSettings& settings, std::span<BankSlot> slots);

  absl::StatusOr<BankId> Add(std::unique_ptr<OscillatorBank> bank, std::shared_ptr<Voice> voice,
                             BusId bus) ABSL_LOCKS_EXCLUDED(kRenderRole);
  void LetRingOut(BankId bank) ABSL_LOCKS_EXCLUDED(kRenderRole);
  void FadeOut(BankId bank) ABSL_LOCKS_EXCLUDED(kRenderRole);
  absl::StatusOr<std::unique_ptr<EventStream>> OpenStream(size_t capacity, StreamKind kind)
      ABSL_LOCKS_EXCLUDED(kRenderRole);

  /// Reserves a bus that nobody uses.
  absl::StatusOr<BusId> OpenBus() ABSL_LOCKS_EXCLUDED(kRenderRole);
  void CloseBus(BusId bus) ABSL_LOCKS_EXCLUDED(kRenderRole);

  void CollectGarbage() ABSL_LOCKS_EXCLUDED(kRenderRole);
  size_t mode_count() const ABSL_LOCKS_EXCLUDED(kRenderRole);

  /// Takes the next command, if there is one. Only the rendering thread calls this and SendBack.
  bool TryTake(MixerCommand& command) noexcept { return commands_.TryPop(command); }
  void SendBack(const MixerRetired& retired) noexcept;

 private:
  struct OwnedBank {
    std::unique_ptr<OscillatorBank> bank;
    std::shared_ptr<Voice> voice;
    uint32_t generation = 0;
    uint32_t section = 0;
    size_t mode_count = 0;
    bool leaving = false;
    bool fading = false;
  };
  struct OwnedBus {
    std::array<size_t, kSectionCount> mode_counts{};  // of each section
    size_t bank_count = 0;
    bool open = false;
  };

  OwnedBank* Find(BankId id) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  uint32_t ChooseSection(BusId bus) const ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  /// Makes the section of this number and returns it, or returns null if it was made before.
  MixedSection* MakeSection(uint32_t section) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void Send(const MixerCommand& command) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  const MixerSettings settings_;
  // The slots, for sections that are made while others are rendered, and read them later.
  const std::span<BankSlot> slots_;
  mutable Mutex mutex_;
  std::vector<OwnedBank> banks_ ABSL_GUARDED_BY(mutex_);
  std::vector<uint32_t> free_slots_ ABSL_GUARDED_BY(mutex_);
  std::vector<OwnedBus> buses_ ABSL_GUARDED_BY(mutex_);
  std::vector<std::unique_ptr<MixedSection>> sections_ ABSL_GUARDED_BY(mutex_);
  std::vector<std::shared_ptr<EventQueue>> queues_ ABSL_GUARDED_BY(mutex_);
  SpscQueue<MixerCommand> commands_;  // produced under mutex_
  SpscQueue<MixerRetired> retired_;   // consumed under mutex_
};

/// Returns the stagger of a bus: see Mixer::Stagger.
size_t StaggerOf(BusId bus);

}  // namespace carillon
