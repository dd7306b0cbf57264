// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <functional>
#include <memory>
#include <numbers>
#include <utility>
#include <vector>

#include "server/synthesis/voice/head.h"
#include "server/synthesis/voice/voice.h"
#include "tests/server/synthesis/sound.h"

namespace carillon {

inline constexpr double kVoiceRateHz = 48000;

/// In front of the listener, at the height of the ears, and so far to the right.
inline Vector3 At(double degrees_to_the_right, double distance = 1) {
  const double angle = degrees_to_the_right * std::numbers::pi / 180;
  return {distance * std::sin(angle), 0, -distance * std::cos(angle)};
}

using Channels = std::array<std::vector<float>, 2>;

/// A voice that is fed a sound.
class Heard {
 public:
  Heard(const HearingSettings& hearing, const Place& object, size_t channel_count = 2,
        std::shared_ptr<const Head> head = nullptr, size_t block_frame_count = 128,
        double rate_hz = kVoiceRateHz)
      : channel_count_(channel_count),
        block_(block_frame_count),
        voice_({.hearing = hearing,
                .sample_rate_hz = rate_hz,
                .block_frame_count = block_frame_count,
                .channel_count = channel_count,
                .head = std::move(head)},
               object, {}) {}

  Voice& voice() { return voice_; }

  /// `at_block`, if any, is called before each block. Returns the first channel and the last.
  Channels Play(const std::vector<float>& sound,
                const std::function<void(Voice&, size_t frame)>& at_block = {}) {
    Channels heard;
    for (size_t n = 0; n + block_ <= sound.size(); n += block_) {
      if (at_block) at_block(voice_, n);
      std::copy_n(sound.begin() + static_cast<ptrdiff_t>(n), block_, voice_.input().begin());
      std::vector<float> frames(block_ * channel_count_);
      voice_.Render(frames);
      for (size_t i = 0; i < block_; ++i) {
        heard[0].push_back(frames[i * channel_count_]);
        heard[1].push_back(frames[(i + 1) * channel_count_ - 1]);
      }
    }
    return heard;
  }

 private:
  size_t channel_count_, block_;
  Voice voice_;
};

inline Motion MotionTo(const std::array<double, 3>& to, double glide_frames) {
  Motion motion{.glide_frames = static_cast<float>(glide_frames)};
  for (size_t i = 0; i < 3; ++i) motion.position_m[i] = static_cast<float>(to[i]);
  return motion;
}

inline std::vector<float> Tone(double frequency_hz, double seconds, double amplitude = 0.5) {
  std::vector<float> tone(static_cast<size_t>(std::lround(seconds * kVoiceRateHz)));
  for (size_t n = 0; n < tone.size(); ++n) {
    const double phase =
        2 * std::numbers::pi * frequency_hz * static_cast<double>(n) / kVoiceRateHz;
    tone[n] = static_cast<float>(amplitude * std::sin(phase));
  }
  return tone;
}

inline std::vector<float> Click(size_t frame, size_t frame_count) {
  std::vector<float> click(frame_count);
  click[frame] = 1;
  return click;
}

}  // namespace carillon
