// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "server/synthesis/mixer.h"
#include "tests/server/synthesis/closed_form.h"

namespace carillon {

/// A bank whose modes all move by `shape` along x.
inline std::unique_ptr<OscillatorBank> MakeBank(const std::vector<SoundingMode>& modes,
                                                float shape = 1) {
  return std::make_unique<OscillatorBank>(SoundingModes{.modes = modes},
                                          MakeUniformShapes(modes.size(), shape),
                                          OscillatorBankSettings{});
}

inline void Strike(EventStream& stream, BankId bank, uint64_t frame = 0, float fraction = 0,
                   float newton_seconds = 1) {
  SurfaceImpulse impulse = MakeUnitImpulse();
  impulse.impulse_newton_seconds[0] = newton_seconds;
  stream.TryPush({.bank = bank, .frame = frame, .fraction = fraction, .action = impulse});
}

inline std::vector<float> Render(Mixer& mixer, size_t block_count, size_t blocks_a_call = 1) {
  const size_t block_size = mixer.settings().block_frame_count * mixer.settings().channel_count;
  std::vector<float> frames(block_count * block_size);
  for (size_t n = 0; n < frames.size(); n += blocks_a_call * block_size) {
    mixer.Render(std::span(frames).subspan(n, blocks_a_call * block_size));
  }
  return frames;
}

/// Expects that a sound from frame `begin` on is that of unit strikes on a mode at these frames.
inline void ExpectStrikes(std::span<const float> sound, const SoundingMode& mode, size_t begin,
                          const std::vector<double>& strikes) {
  const SoundingModes sounding{.modes = {mode}};
  for (size_t n = 0; n < sound.size(); ++n) {
    EXPECT_NEAR(sound[n], SumOfStrikes(sounding, strikes, begin + n), 1e-6) << n;
  }
}

}  // namespace carillon
