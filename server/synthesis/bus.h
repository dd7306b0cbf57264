// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "server/synthesis/fader.h"
#include "server/synthesis/render_section.h"

namespace carillon {

/// Names a bus of a mixer, whose banks share a gain. A default BusId names the bus that always
/// exists.
struct BusId {
  uint32_t index = 0;
  friend bool operator==(const BusId&, const BusId&) = default;
};

/// The sound of a bus at this moment, in figures.
struct BusState {
  uint64_t active_mode_count = 0;  ///< modes that ring
  float peak = 0;                  ///< the largest sample of late; it falls by 40 dB a second
};

/// Receives the sound of one bus.
class BusListener {
 public:
  virtual ~BusListener() = default;

  /// Takes a block of the bus, after its gain, interleaved. The rendering thread calls it: it must
  /// not allocate, lock, log, throw or call the system.
  virtual void Hear(uint64_t first_frame, std::span<const float> block) noexcept = 0;

  /// Called when the bus is closed, by a controlling thread. At most the block that is being
  /// rendered still follows.
  virtual void End() {}
};

/// One section of a bus with the sound that it has rendered last.
struct MixedSection {
  MixedSection(const RenderSection::Settings& settings, std::span<BankSlot> slots,
               size_t most_frames)
      : section(settings, slots),
        frames(most_frames),
        placed(most_frames * settings.channel_count) {}

  RenderSection section;
  std::vector<float> frames;  // banks without a voice, mono
  std::vector<float> placed;  // voices, interleaved
  std::span<const DueEvent> due{};
  SectionCounts counts;
};

/// A bus as the rendering thread sees it, with the settings that the controlling threads leave
/// there.
struct Bus {
  explicit Bus(double sample_rate_hz) : fader(sample_rate_hz), stop(sample_rate_hz) {}

  // Controlling threads write these.
  std::atomic<float> gain{1};
  std::atomic<bool> jumps{false};  ///< the gain changes without a glide
  std::atomic<uint32_t> stops_asked{0};
  std::atomic<BusListener*> listener{nullptr};

  // The rendering thread writes these.
  std::atomic<uint64_t> active_mode_count{0};
  std::atomic<float> peak{0};

  // Only the rendering thread uses what follows.
  Fader fader;
  /// This fader falls to zero when the bus is to be silenced, and is one again when the bus is
  /// silent.
  Fader stop;
  /// Events that came before the last stop are not rendered.
  uint32_t stop_count = 0;

  /// Whether something was rendered in the last blocks.
  bool sounded = false;

  /// Whether a gain glides, or the bus fades out to be silenced.
  bool changes() const noexcept { return !fader.resting() || !stop.neutral(); }

  /// Takes over the settings of the controlling threads. A bus that is silent needs neither glide
  /// nor fade.
  void Listen() noexcept {
    const float target = gain.load(std::memory_order_relaxed);
    const bool opened = jumps.exchange(false, std::memory_order_acquire);
    if (opened) peak.store(0, std::memory_order_relaxed);
    if (opened || !sounded) fader.JumpTo(target);
    fader.GlideTo(target);
    const uint32_t asked = stops_asked.load(std::memory_order_acquire);
    if (asked == stop_count) return;
    stop_count = asked;
    if (sounded) stop.GlideTo(0);
  }
};

}  // namespace carillon
