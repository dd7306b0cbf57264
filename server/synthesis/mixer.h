// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <span>
#include <vector>

#include "absl/status/statusor.h"
#include "server/base/spsc_ring.h"
#include "server/synthesis/lane_mix.h"
#include "server/synthesis/limiter.h"
#include "server/synthesis/oscillator_bank.h"
#include "server/synthesis/strike.h"

namespace carillon {

/// Bounds of a mixer; all memory is taken when it is made.
struct MixerSettings {
  double sample_rate_hz = 48000;
  size_t block_frame_count = 128;  ///< at most kMostBlockFrames
  size_t most_banks = 8192;        ///< those that ring out included
  size_t most_streams = 1024;
  size_t most_pending_strikes = 65536;   ///< waiting for their time
  size_t most_strikes_per_block = 1024;  ///< further ones sound in the next block
};

/// What a mixer has counted since it was made.
struct MixerStatistics {
  uint64_t frame_count = 0;          ///< rendered
  uint64_t accepted_count = 0;       ///< strikes that came in time
  uint64_t late_count = 0;           ///< strikes that came too late and sounded at once
  uint64_t dropped_count = 0;        ///< strikes lost: queue full, no such bank, or not finite
  uint64_t postponed_count = 0;      ///< strikes put off by a block because there were too many
  uint64_t reset_bank_count = 0;     ///< banks silenced because their state was not finite
  uint64_t limited_frame_count = 0;  ///< frames in which the limiter worked
  uint64_t bank_count = 0;
  uint64_t active_mode_count = 0;
};

/// Carries the strikes of one contact stream to the mixer. One thread at a time. When it is
/// destroyed, what was pushed still sounds.
class StrikeStream {
 public:
  ~StrikeStream();
  StrikeStream(const StrikeStream&) = delete;
  StrikeStream& operator=(const StrikeStream&) = delete;

  /// False: the queue to the mixer is full and the strike is lost (counted as dropped).
  bool TryPush(const Strike& strike) noexcept;

  /// Of this stream: strikes taken in time, late, lost. Settled a block after the push.
  uint64_t accepted_count() const noexcept;
  uint64_t late_count() const noexcept;
  uint64_t dropped_count() const noexcept;

 private:
  friend class Mixer;
  struct Shared;
  explicit StrikeStream(std::shared_ptr<Shared> shared);
  std::shared_ptr<Shared> shared_;
};

/// Renders all sounding objects into one stream of samples.
///
/// Threads: one at a time calls Render; any may call the rest. Nothing under Render allocates,
/// locks, logs, throws or calls the system. What is struck at the same frames sounds bit for bit
/// the same on one SIMD target, however many blocks a call of Render covers.
class Mixer {
 public:
  explicit Mixer(const MixerSettings& settings = {});
  ~Mixer();
  Mixer(const Mixer&) = delete;
  Mixer& operator=(const Mixer&) = delete;

  /// Renders the next frames, mono, within +-1. `block` holds whole blocks of block_frame_count.
  void Render(std::span<float> block) noexcept;

  /// Puts a bank on the mixer; it can be struck when the call returns. The bank was made with this
  /// mixer's sample rate and block. RESOURCE_EXHAUSTED (TOO_MANY_OBJECTS).
  absl::StatusOr<BankId> Add(std::unique_ptr<OscillatorBank> bank);

  /// Takes a bank off once it is silent. The caller sends it no further strikes; those on their way
  /// still sound.
  void LetRingOut(BankId bank);

  /// Takes a bank off after a fade of 10 ms; strikes on their way to it are lost.
  void FadeOut(BankId bank);

  /// RESOURCE_EXHAUSTED (TOO_MANY_STREAMS).
  absl::StatusOr<std::unique_ptr<StrikeStream>> OpenStream(size_t capacity = 4096);

  /// Frees what Render has retired; a housekeeping thread calls it now and then.
  void CollectGarbage();

  /// Number of the next frame to be rendered.
  uint64_t frame() const noexcept { return frame_.load(std::memory_order_acquire); }

  MixerStatistics statistics() const noexcept;

  /// The largest sample before the limiter since the last call.
  double TakePeak() noexcept { return peak_.exchange(0, std::memory_order_relaxed); }

  const MixerSettings& settings() const { return settings_; }

 private:
  MixerSettings settings_;
  std::atomic<uint64_t> frame_{0};
  std::atomic<float> peak_{0};
};

}  // namespace carillon
