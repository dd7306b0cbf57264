// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstddef>
#include <memory>
#include <span>
#include <vector>

#include "server/synthesis/bank/block_mix.h"
#include "server/synthesis/bank/level.h"
#include "server/synthesis/bank/oscillator_bank.h"
#include "server/synthesis/bank/sounding_modes.h"
#include "server/synthesis/mixer.h"
#include "tests/server/synthesis/sound.h"

namespace carillon {

inline constexpr double kTestSampleRateHz = 48000;
inline constexpr double kTestFrameS = 1 / kTestSampleRateHz;

/// A body of one triangle whose shapes are given by the tests: values[(vertex*3 + axis)*m + mode].
inline ShapeTable MakeShapes(const std::vector<float>& values, size_t mode_count) {
  return {values, values.size() / (3 * mode_count), mode_count};
}

/// Every mode moves by `shape` along x at vertices 0 to 2, and not along y and z.
inline ShapeTable MakeUniformShapes(size_t mode_count, float shape = 1) {
  std::vector<float> values(9 * mode_count, 0.0F);
  for (size_t vertex = 0; vertex < 3; ++vertex) {
    std::fill_n(values.begin() + static_cast<ptrdiff_t>(3 * vertex * mode_count), mode_count,
                shape);
  }
  return MakeShapes(values, mode_count);
}

/// A unit impulse along x in the middle of the triangle.
inline SurfaceImpulse MakeUnitImpulse() {
  return {.at = {.vertices = {0, 1, 2}, .weights = {1.0F / 3, 1.0F / 3, 1.0F / 3}},
          .impulse_newton_seconds = {1, 0, 0}};
}

inline SoundingMode MakeMode(uint32_t column, double frequency_hz, double decay_rate_per_s,
                             double coupling = 1) {
  return {.column = column,
          .natural_frequency_hz = frequency_hz,
          .damped_rad_per_s = 2 * std::numbers::pi * frequency_hz,
          .decay_rate_per_s = decay_rate_per_s,
          .coupling = coupling};
}

/// The closed form of one mode's sound `time_s` after an impulse with modal impulse `g`
/// (docs/physics.md, 3), in
/// samples, with the Gaussian contact's factor and, for the second of a pair, its companion.
inline double ClosedForm(const SoundingMode& mode, double g, double time_s, double tau_s = 0) {
  if (time_s < 0) return 0;
  using Complex = std::complex<double>;
  const Complex s(mode.decay_rate_per_s, mode.damped_rad_per_s);
  const Complex contact = std::exp(s * s * tau_s * tau_s / 2.0);
  const Complex phase = std::polar(1.0, mode.output_phase_rad);
  Complex ringing = std::exp(s * time_s);
  if (mode.output_phase_rad != 0) ringing -= std::exp((s - mode.damped_rad_per_s) * time_s);
  const double z = g / mode.damped_rad_per_s * (contact * phase * ringing).imag();
  return kSamplesPerVolumeVelocity * mode.coupling * z;
}

inline double SumOfModes(const SoundingModes& sounding, double g, double time_s, double tau_s = 0) {
  double sum = 0;
  for (const SoundingMode& mode : sounding.modes) sum += ClosedForm(mode, g, time_s, tau_s);
  return sum;
}

/// The sound of unit strikes at these frames, in frame n.
inline double SumOfStrikes(const SoundingModes& sounding, const std::vector<double>& strikes,
                           size_t n) {
  double sum = 0;
  for (const double strike : strikes) {
    sum += SumOfModes(sounding, 1, (static_cast<double>(n) - strike) * kTestFrameS);
  }
  return sum;
}

/// Largest deviation from right(n) over its largest value, decibels, of every `stride`-th sample
/// from `first` on.
template <class Right>
double DeviationDb(std::span<const float> sound, size_t first, size_t stride, const Right& right) {
  double error = 0, peak = 0;
  for (size_t n = first; n < sound.size(); n += stride) {
    const double wanted = right(n);
    error = Larger(error, std::abs(sound[n] - wanted));
    peak = std::max(peak, std::abs(wanted));
  }
  return 20 * std::log10(error / peak);
}

/// The same of the closed form; of long sounds every 13th sample is compared.
inline double ErrorDb(const std::vector<float>& sound, const SoundingModes& sounding, double g,
                      double strike_frame, double tau_s = 0) {
  return DeviationDb(sound, 0, sound.size() > 10000 ? 13 : 1, [&](size_t n) {
    return SumOfModes(sounding, g, (static_cast<double>(n) - strike_frame) * kTestFrameS, tau_s);
  });
}

/// The same of unit strikes at these frames.
inline double StrikesErrorDb(std::span<const float> sound, size_t first, size_t stride,
                             const SoundingModes& sounding, const std::vector<double>& strikes) {
  return DeviationDb(sound, first, stride,
                     [&](size_t n) { return SumOfStrikes(sounding, strikes, n); });
}

/// Modes over the whole band and all kinds of decay; more than a vector of them, not a multiple.
inline SoundingModes MakeWideModes() {
  SoundingModes sounding;
  for (uint32_t m = 0; m < 37; ++m) {
    const double frequency_hz = 20 * std::pow(1000.0, m / 36.5);
    sounding.modes.push_back(MakeMode(m, frequency_hz, m % 3 == 0 ? -0.2 : -0.5 * (m + 1), 40 + m));
  }
  return sounding;
}
/// A mix and its workspace, block by block.
class TestMix {
 public:
  explicit TestMix(size_t block_frame_count = 128, size_t stagger = 0)
      : workspace_(block_frame_count), mix_(block_frame_count, stagger) {}

  BlockMix& Begin() {
    mix_.Begin(block_number_++, workspace_);
    return mix_;
  }
  void Finish(std::span<float> block) { mix_.Finish(block); }
  /// The rest of the block, of one bank alone.
  void Render(OscillatorBank& bank, std::span<float> block) {
    bank.RenderAdd(mix_);
    Finish(block);
  }
  /// Further blocks of 128 frames, of which it returns the last.
  std::vector<float> RenderOn(OscillatorBank& bank, size_t block_count) {
    std::vector<float> block(128);
    for (size_t i = 0; i < block_count; ++i) {
      Begin();
      Render(bank, block);
    }
    return block;
  }

 private:
  RenderWorkspace workspace_;
  BlockMix mix_;
  uint64_t block_number_ = 0;
};

/// Renders a bank by itself, without mixer or limiter. `at_block(number, mix)` comes before each
/// block.
template <class AtBlock>
std::vector<float> RenderBlocks(OscillatorBank& bank, size_t block_count, const AtBlock& at_block,
                                size_t block_frame_count = 128, size_t stagger = 0) {
  std::vector<float> sound(block_count * block_frame_count);
  TestMix test(block_frame_count, stagger);
  for (size_t block = 0; block < block_count; ++block) {
    at_block(block, test.Begin());
    test.Render(bank, std::span(sound).subspan(block * block_frame_count, block_frame_count));
  }
  return sound;
}

/// The same after one impulse.
inline std::vector<float> Ring(OscillatorBank& bank, const SurfaceImpulse& impulse,
                               size_t frame_count, size_t offset = 0, float lead_frames = 0,
                               size_t block_frame_count = 128, size_t stagger = 0) {
  const auto strike = [&](size_t block, BlockMix& mix) {
    if (block == 0) bank.Strike(impulse, offset, lead_frames, mix);
  };
  return RenderBlocks(bank, frame_count / block_frame_count, strike, block_frame_count, stagger);
}

}  // namespace carillon
