// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "server/synthesis/schedule/mixer_event.h"
#include "server/synthesis/voice/delay_line.h"
#include "server/synthesis/voice/glide.h"

namespace carillon {

/// What of its place is heard of an object.
struct HearingSettings {
  bool distance_gain = false;
  bool propagation_delay = false;
  bool panning = false;
  double reference_distance_m = 1;
  double sound_speed_m_per_s = 343;

  bool any() const { return distance_gain || propagation_delay || panning; }
};

/// Propagation takes no longer.
inline constexpr double kLongestPropagationS = 0.6;

/// Takes the sound of one object to the ears of a listener:
///
///   gain   reference / max(r, reference)
///   delay  d = r/c, with r = |x(t - d) - l(t)|: from where the object was when it sounded
///   left, right   sqrt(2) cos(pi (1 + s)/4), sqrt(2) sin(pi (1 + s)/4), s = right . (x - l)/r
///
/// each at the ends of the blocks, the delay between them a cubic without a kink, so that a moving
/// object changes its pitch as it should and does not click; a block behind. A jump is a fade of 10
/// ms from one place to the other. Delays are kLeastDelay samples of a DelayLine or more, so that
/// what is nearer than 0.1 m (at 48 kHz) counts as there.
///
/// Made anywhere; then used by one thread at a time, which neither allocates nor locks.
class Voice {
 public:
  struct Settings {
    HearingSettings hearing;
    double sample_rate_hz = 48000;
    size_t block_frame_count = 128;
    size_t channel_count = 1;
  };

  Voice(const Settings& settings, const Place& object, const Place& listener);

  /// In this block, before Render.
  void Move(const Motion& motion, size_t offset) noexcept { object_.Move(motion, offset); }
  void MoveListener(const Motion& motion, size_t offset) noexcept {
    listener_.Move(motion, offset);
  }

  /// What the object sounds in this block: zeros to be added to.
  std::span<float> input() noexcept {
    fed_ = true;
    return input_;
  }

  /// Adds the block to `frames`, interleaved, and ends it.
  void Render(std::span<float> frames) noexcept;

  /// Nothing is heard of it and nothing moves: no Render is needed until it moves or sounds.
  bool asleep() const noexcept { return asleep_; }
  void Awake() noexcept { asleep_ = false; }

  /// The mixer's: which section renders it, set when its first bank comes, and how many banks
  /// Render knows.
  std::optional<uint32_t> section;
  uint32_t bank_count = 0;

 private:
  /// How it is heard at one time.
  struct Heard {
    double delay_frames = 0;
    std::array<float, 2> gains{};
  };
  /// At the ends of four blocks; the sound is between the second and the third.
  using Hearings = std::array<Heard, 4>;

  std::array<double, 3> PositionBefore(double blocks) const noexcept;
  Heard Hear(double delay_frames) const noexcept;
  void NoteHeard() noexcept;
  void RenderFrom(const Hearings& heard, float fade, float fade_step,
                  std::span<float> frames) noexcept;
  float Sample(double delay_frames, size_t n) const noexcept;
  /// Nothing of what it was fed is still on its way.
  bool silent() const noexcept {
    return quiet_frame_count_ > (line_ ? line_->length() : size_t{0});
  }
  bool delayed() const noexcept { return settings_.hearing.propagation_delay; }

  Settings settings_;
  Glide object_, listener_;
  std::vector<std::array<double, 3>> positions_;  // at the ends of the last blocks, a ring
  size_t newest_ = 0;
  std::vector<float> input_;
  std::optional<DelayLine> line_;
  Hearings heard_{}, heard_before_{};
  float fade_ = 1, fade_step_;
  bool jump_waits_ = false, fed_ = false, asleep_ = true;
  size_t quiet_frame_count_ = SIZE_MAX / 2, rest_block_count_ = 0;
};

}  // namespace carillon
