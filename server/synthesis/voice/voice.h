// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "server/base/pose.h"
#include "server/synthesis/schedule/bearing.h"
#include "server/synthesis/schedule/mixer_event.h"
#include "server/synthesis/voice/ambisonics.h"
#include "server/synthesis/voice/delay_line.h"
#include "server/synthesis/voice/doppler.h"
#include "server/synthesis/voice/ears.h"
#include "server/synthesis/voice/glide.h"
#include "server/synthesis/voice/head.h"

namespace carillon {

/// Which spatial effects apply to an object.
struct HearingSettings {
  bool distance_gain = false;
  bool propagation_delay = false;
  bool panning = false;
  bool binaural = false;     ///< by the responses of a measured head, in place of panning
  bool ambisonic = false;    ///< in (order + 1)^2 channels, in place of panning
  bool directivity = false;  ///< modes sound as loud as they radiate towards the listener
  bool near_field = false;   ///< directivity includes the near field
  double reference_distance_m = 1;
  double sound_speed_m_per_s = 343;

  bool operator==(const HearingSettings&) const = default;
  bool any() const {
    return distance_gain || propagation_delay || panning || binaural || ambisonic || directivity;
  }
};

/// Longest propagation delay; the sound of objects farther away arrives after this time.
inline constexpr double kLongestPropagationS = 0.6;

/// Renders the sound of one object as a listener hears it:
///
///   gain   reference / max(r, reference)
///   delay  d = r/c, with r = |x(t - d) - l(t)|: from where the object was when it sounded
///   left, right   sqrt(2) cos(pi (1 + s)/4), sqrt(2) sin(pi (1 + s)/4), s = right . (x - l)/r
///
/// Gains and delay are evaluated at the ends of blocks. Between them, gains are interpolated
/// linearly and the delay by a cubic with continuous slope, so that a moving object has the right
/// Doppler shift and does not click. The voice is one block late. A jump, or a delay that grows by
/// more than 0.9 or shrinks by more than 3 frames in a frame, is rendered as a cross-fade of 10 ms.
/// Frequencies that are shifted above Nyquist alias. The delay is at least DelayLine::kLeastDelay
/// samples, the delay of an object at 0.09 m (at 48 kHz).
///
/// In ambisonics, the gains are those of AmbisonicGains for the direction of the sound.
///
/// For two ears, the responses of a measured head for the direction of the sound replace the gains
/// to left and right. The delays of these responses add to d, so that each ear has its own Doppler
/// shift.
///
/// Any thread may construct a voice; then one thread at a time uses it. Only the constructor
/// allocates; nothing locks.
class Voice {
 public:
  struct Settings {
    HearingSettings hearing;
    double sample_rate_hz = 48000;
    size_t block_frame_count = 128;
    size_t channel_count = 1;
    /// The listener's head. If `hearing.binaural` is true, the head must not be null, and there
    /// must be two channels.
    std::shared_ptr<const Head> head = nullptr;
  };

  Voice(const Settings& settings, const Place& object, const Place& listener);

  /// These two functions start a motion of the object or of the listener at sample `offset` of this
  /// block. The caller must call them before Render.
  void Move(const Motion& motion, size_t offset) noexcept { object_.Move(motion, offset); }
  void MoveListener(const Motion& motion, size_t offset) noexcept {
    listener_.Move(motion, offset);
  }

  /// Sets the point of the object's frame from which its sound comes; without a call it is the
  /// origin.
  void SetCenter(const Vector3& center_m) noexcept;

  /// Returns the bearing of the listener at the start of this block, from the point that sounds.
  /// The gains of the last block are for the same time, because the voice is one block late.
  Bearing BearingOfListener() const noexcept;

  const HearingSettings& hearing() const noexcept { return settings_.hearing; }

  /// Returns the buffer of the object's sound in this block: zeros, to which banks add their sound.
  std::span<float> input() noexcept {
    fed_ = true;
    return input_;
  }

  /// Adds the block to `frames`, interleaved, and begins the next block. A silent voice only
  /// follows the places of object and listener.
  void Render(std::span<float> frames) noexcept;

  /// Whether the next call of Render has sound to render.
  bool sounding() const noexcept { return fed_ || !silent(); }

  /// Whether the voice renders for two ears.
  bool binaural() const noexcept { return !ears_.empty(); }

  /// Ends the sound that is on its way to the listener. The caller must call it between two blocks.
  void Silence() noexcept;

  /// Whether the voice is silent and nothing moves, so that Render need not be called until the
  /// object moves or sounds.
  bool asleep() const noexcept { return asleep_; }
  void Wake() noexcept { asleep_ = false; }

  /// State of the mixer: the section that renders the voice, set with its first bank, and the
  /// number of its banks on the mixer.
  std::optional<uint32_t> section;
  uint32_t bank_count = 0;

 private:
  /// Delay and gains at one time. For a binaural listener, `direction` points from the listener to
  /// the sound, in the listener's frame, and the sound reaches each ear after delay_frames and the
  /// ear_delay_frames of that ear.
  struct Heard {
    double delay_frames = 0;
    std::array<float, kMostChannels> gains{};
    std::array<double, 2> ear_delay_frames{};
    Vector3 direction{0, 0, -1};
  };
  /// Values at the ends of four consecutive blocks; the rendered block lies between the second and
  /// the third.
  using Hearings = std::array<Heard, 4>;

  Vector3 SoundAt(const Place& object) const noexcept;
  Heard Hear(double delay_frames) const noexcept;
  void HearBinaurally(const Vector3& away_m, const Place& listener, Heard& heard) const noexcept;
  void NoteHeard() noexcept;
  void RenderSound(std::span<float> frames) noexcept;
  void NoteEars(bool jumps) noexcept;
  void RenderFrom(const Hearings& heard, float fade, float fade_step,
                  std::span<float> frames) noexcept;
  void RenderHere(const Hearings& heard, std::span<float> frames) const noexcept;
  void RenderEars(const Hearings& heard, Ears& ears, float fade, float fade_step,
                  std::span<float> frames) noexcept;
  float Sample(double delay_frames, size_t n) const noexcept;
  /// Whether nothing has moved for so long that nothing will change until the next motion.
  bool rested() const noexcept { return rest_block_count_ > positions_.size() + heard_.size(); }
  /// Whether all of the object's sound has arrived.
  bool silent() const noexcept {
    const size_t ears = binaural() ? settings_.head->tap_count() : 0;
    return quiet_frame_count_ > (line_ ? line_->length() : size_t{0}) + ears;
  }
  bool delayed() const noexcept { return settings_.hearing.propagation_delay; }

  Settings settings_;
  Glide object_, listener_;
  Vector3 center_m_{};  // in the object's frame
  PastPositions positions_;
  std::vector<float> input_;
  std::optional<DelayLine> line_;
  Hearings heard_{}, heard_before_{};
  std::vector<Ears> ears_;    // for heard_ and for heard_before_; none without a head
  size_t ears_now_ = 0;       // those for heard_
  std::vector<float> sound_;  // in one ear
  float fade_ = 1, fade_step_;
  bool jump_waits_ = false, fed_ = false, asleep_ = true;
  size_t quiet_frame_count_ = SIZE_MAX / 2, rest_block_count_ = 0;
};

}  // namespace carillon
