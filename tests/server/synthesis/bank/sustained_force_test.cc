// SPDX-License-Identifier: Apache-2.0
#include "server/synthesis/bank/sustained_force.h"

#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <limits>
#include <vector>

#include "tests/server/synthesis/closed_form.h"

namespace carillon {
namespace {

constexpr size_t kBlock = 128;

SoundingModes ThreeModes() {
  return {.modes = {MakeMode(0, 400, -3), MakeMode(1, 1100, -5), MakeMode(2, 5000, -40)}};
}

/// A bank whose force is `force_newtons(t)` at every step of `step_frames` frames, rendered.
class Held {
 public:
  explicit Held(const SoundingModes& modes)
      : bank_(modes, MakeUniformShapes(modes.modes.size()), {.noise_seed = 7}) {}

  void ApplyKnot(double force_newtons, const ForceKnot& knot, size_t offset) {
    EXPECT_TRUE(bank_.AddForce(
        {.at = MakeUnitImpulse().at, .force_newtons = {static_cast<float>(force_newtons), 0, 0}}));
    EXPECT_TRUE(bank_.ApplyKnot(knot, offset, *mix_));
  }

  template <typename Force>
  std::vector<float> Render(size_t frame_count, size_t step_frames, const Force& force_newtons,
                            ForceKnot knot = {}) {
    std::vector<float> sound(frame_count / kBlock * kBlock);
    knot.step_s = static_cast<float>(static_cast<double>(step_frames) / kTestSampleRateHz);
    size_t next_knot = 0;
    for (size_t start = 0; start < sound.size(); start += kBlock) {
      mix_ = &test_.Begin();
      for (; next_knot < start + kBlock; next_knot += step_frames) {
        ApplyKnot(force_newtons(static_cast<double>(next_knot) / kTestSampleRateHz), knot,
                  next_knot - start);
      }
      test_.Render(bank_, std::span(sound).subspan(start, kBlock));
    }
    return sound;
  }

  /// Lets `block_count` blocks pass without a knot.
  void Wait(size_t block_count) { test_.RenderOn(bank_, block_count); }

  bool silent() const { return bank_.silent(); }

 private:
  OscillatorBank bank_;
  TestMix test_;
  BlockMix* mix_ = nullptr;
};

class AtEveryStep : public testing::TestWithParam<int> {};
INSTANTIATE_TEST_SUITE_P(SustainedForce, AtEveryStep, testing::Values(60, 240, 1000));

TEST_P(AtEveryStep, AConstantForceIsSilent) {
  const size_t step_frames = 48000 / static_cast<size_t>(GetParam());
  Held held(ThreeModes());
  const auto sound = held.Render(10 * 48000, step_frames, [](double) { return 1000.0; });
  // The onset rings, for the mode of 400 Hz 60 dB in 2.3 s; a constant force adds nothing to that.
  EXPECT_GT(Peak(std::span(sound).first(48000)), 0);
  EXPECT_EQ(Peak(std::span(sound).last(48000)), 0);
}

TEST_P(AtEveryStep, AJitteringLoadIsFarBelowTheBodysOwnImpact) {
  const size_t step_frames = 48000 / static_cast<size_t>(GetParam());
  const double weight = 9.81;  // of 1 kg
  Held held(ThreeModes());
  const auto sound = held.Render(4 * 48000, step_frames, [&](double t) {
    return weight * (1 + 0.3 * std::sin(1e6 * t));  // as good as random from step to step
  });
  OscillatorBank bank(ThreeModes(), MakeUniformShapes(3), {});
  const auto impact = Ring(bank, MakeUnitImpulse(), 48000);  // 1 kg that falls at 1 m/s
  const double quiet_db = 20 * std::log10(Peak(std::span(sound).last(48000)) / Peak(impact));
  // Each knot begins abruptly, and would be a click if it were louder.
  EXPECT_LT(quiet_db, -120);
}

TEST(SustainedForce, AChangeOfSlopeRingsAsTheFreeResponseToARamp) {
  const SoundingModes modes{.modes = {MakeMode(0, 100, -3)}};
  Held held(modes);
  // One knot: from zero over the 0.1 s before it to a force that no body bears, because the
  // response to a smaller one counts as silence.
  constexpr double kForceNewtons = 5e8;
  const auto sound = held.Render(4800, 4800, [](double) { return kForceNewtons; }, {});
  const std::complex<double> s(-3, modes.modes[0].damped_rad_per_s);
  const double tau_s = 5 / s.imag();
  const double slope = kForceNewtons / 0.1;
  const std::complex<double> state = kSamplesPerVolumeVelocity * slope / s.imag() *
                                     std::complex<double>(0, -1) *
                                     std::exp(s * s * tau_s * tau_s / 2.0) / (s * s);
  for (size_t n = 0; n < 4800 - kBlock; n += 7) {
    const double t = static_cast<double>(n) / kTestSampleRateHz;
    EXPECT_NEAR(sound[n], (state * std::exp(s * t)).real(), 1e-4 * std::abs(state));
  }
}

TEST(SustainedForce, RoughnessDrivesTheModesAsItsNoiseSays) {
  const SoundingModes modes = ThreeModes();
  Held held(modes);
  const double full_load = 20, depth = 0.5, bandwidth_hz = 3000;
  const auto sound = held.Render(
      9600, 800, [&](double) { return full_load; },
      {.roughness = static_cast<float>(depth), .bandwidth_hz = static_cast<float>(bandwidth_hz)});
  // The same, mode by mode in double; the first step's force rises from zero.
  RoughnessNoise noise(7);
  noise.SetBandwidth(bandwidth_hz, kTestSampleRateHz);
  std::vector<std::complex<double>> states(3);
  const auto right = [&](size_t n) {
    const double load = full_load * std::min(1.0, static_cast<double>(n) / 800);
    const double force = load * depth * noise.Next();
    double sum = 0;
    for (size_t m = 0; m < 3; ++m) {
      const SoundingMode& mode = modes.modes[m];
      const std::complex<double> s(mode.decay_rate_per_s, mode.damped_rad_per_s);
      states[m] += std::complex<double>(0, -1) * force / kTestSampleRateHz / s.imag();
      sum += kSamplesPerVolumeVelocity * states[m].real();
      states[m] *= std::exp(s / kTestSampleRateHz);
    }
    return sum;
  };
  // The knots' kinks ring too, over 120 dB lower.
  EXPECT_LT(DeviationDb(sound, 0, 1, right), -50);
}

TEST(SustainedForce, ARoughSlideOfWhichNothingMoreIsHeardDiesAway) {
  Held held({.modes = {MakeMode(0, 400, -100)}});
  const auto load = [](double) { return 10.0; };
  held.Render(4800, 480, load, {.roughness = 1, .bandwidth_hz = 2000});
  EXPECT_FALSE(held.silent());
  // Held for four steps and let go in one, 2400 frames; then 0.3 s at 100/s are 260 dB.
  held.Wait((2400 + 14400) / kBlock + 1);
  EXPECT_TRUE(held.silent());
  // What hardly moves is silent, too.
  held.Render(4800, 480, load, {.roughness = 1, .bandwidth_hz = 2000});
  const auto sound = held.Render(48000, 480, load, {.roughness = 1, .bandwidth_hz = 1e-6F});
  EXPECT_EQ(Peak(std::span(sound).last(4800)), 0);
}

TEST(SustainedForce, AForceThatIsNoNumberIsRefusedAndLeavesTheBankSound) {
  OscillatorBank bank(ThreeModes(), MakeUniformShapes(3), {});
  TestMix test;
  BlockMix& mix = test.Begin();
  bank.AddForce({.at = MakeUnitImpulse().at,
                 .force_newtons = {std::numeric_limits<float>::infinity(), 0, 0}});
  EXPECT_FALSE(bank.ApplyKnot({.step_s = 0.01F, .roughness = 1, .bandwidth_hz = 500}, 3, mix));
  EXPECT_TRUE(bank.RenderAdd(mix));
  std::vector<float> sound(kBlock);
  test.Finish(sound);
  EXPECT_EQ(Peak(sound), 0);
  const auto ringing = Ring(bank, MakeUnitImpulse(), 4800);
  EXPECT_GT(Peak(ringing), 0);
}

TEST(RoughnessNoise, HasUnitVarianceAndNoMean) {
  for (const double bandwidth_hz : {300.0, 3000.0}) {
    RoughnessNoise noise(1);
    noise.SetBandwidth(bandwidth_hz, kTestSampleRateHz);
    double sum = 0, squares = 0;
    constexpr int kCount = 1 << 20;
    for (int n = 0; n < kCount; ++n) {
      const double x = noise.Next();
      sum += x;
      squares += x * x;
    }
    EXPECT_NEAR(sum / kCount, 0, 0.01);
    // The blocker of what lies below 20 Hz takes up to a tenth of the narrow one.
    EXPECT_NEAR(squares / kCount, 1, bandwidth_hz < 1000 ? 0.15 : 0.03);
  }
}

}  // namespace
}  // namespace carillon
