// SPDX-License-Identifier: Apache-2.0
#include "server/synthesis/bank/oscillator_bank.h"

#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <limits>
#include <numbers>
#include <vector>

#include "tests/server/synthesis/closed_form.h"
#include "tests/server/synthesis/on_every_target.h"

namespace carillon {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kDt = kTestFrameS;

INSTANTIATE_TEST_SUITE_P(OscillatorBank, OnEveryTarget,
                         testing::ValuesIn(hwy::SupportedAndGeneratedTargets()),
                         [](const auto& target) { return hwy::TargetName(target.param); });

TEST_P(OnEveryTarget, StaysWithin100DecibelsOfTheClosedFormForTenSeconds) {
  const SoundingModes sounding = MakeWideModes();
  OscillatorBank bank(sounding, MakeUniformShapes(37), {});
  const auto sound = Ring(bank, MakeUnitImpulse(), 480000);
  const double error_db = ErrorDb(sound, sounding, 1, 0);
  RecordProperty("error_db", std::to_string(error_db));
  EXPECT_LT(error_db, -100);
}

TEST_P(OnEveryTarget, StartsAtAnySampleAndBetweenSamples) {
  const SoundingModes sounding = MakeWideModes();
  for (const size_t offset : {size_t{0}, size_t{1}, size_t{77}, size_t{127}}) {
    for (const float lead : {0.0F, 0.25F, 0.875F}) {
      OscillatorBank bank(sounding, MakeUniformShapes(37), {});
      const auto sound = Ring(bank, MakeUnitImpulse(), 512, offset, lead);
      for (size_t n = 0; n < offset; ++n) ASSERT_EQ(sound[n], 0.0F);
      EXPECT_LT(ErrorDb(sound, sounding, 1, static_cast<double>(offset) - lead), -100);
    }
  }
}

TEST_P(OnEveryTarget, ProjectsAnImpulseOntoTheShapesOfItsTriangle) {
  const size_t mode_count = 53;
  std::vector<float> values(9 * mode_count);
  for (size_t i = 0; i < values.size(); ++i) values[i] = std::sin(static_cast<float>(i * i));
  SoundingModes sounding;  // columns with gaps
  for (uint32_t m = 2; m < mode_count - 3; m += 1 + m % 3) {
    sounding.modes.push_back(MakeMode(m, 300 + 90 * m, -20));
  }
  const SurfaceImpulse impulse{.at = {.vertices = {2, 0, 1}, .weights = {0.2F, 0.5F, 0.3F}},
                               .impulse_newton_seconds = {0.1F, -0.7F, 0.4F}};
  OscillatorBank bank(sounding, MakeShapes(values, mode_count), {});
  const auto sound = Ring(bank, impulse, 1024);
  double error = 0, peak = 0;
  for (size_t n = 0; n < sound.size(); ++n) {
    double right = 0;
    for (const SoundingMode& mode : sounding.modes) {
      double g = 0;
      for (size_t i = 0; i < 3; ++i) {
        for (size_t axis = 0; axis < 3; ++axis) {
          g += double{impulse.at.weights[i]} * impulse.impulse_newton_seconds[axis] *
               values[(3 * impulse.at.vertices[i] + axis) * mode_count + mode.column];
        }
      }
      right += ClosedForm(mode, g, static_cast<double>(n) * kDt);
    }
    error = std::max(error, std::abs(sound[n] - right));
    peak = std::max(peak, std::abs(right));
  }
  EXPECT_LT(20 * std::log10(error / peak), -100);
}

TEST_P(OnEveryTarget, TheSameStrikesGiveTheSameBits) {
  const SoundingModes sounding = MakeWideModes();
  OscillatorBank one(sounding, MakeUniformShapes(37), {}), two(sounding, MakeUniformShapes(37), {});
  EXPECT_EQ(Ring(one, MakeUnitImpulse(), 4096, 5, 0.5F),
            Ring(two, MakeUnitImpulse(), 4096, 5, 0.5F));
}

TEST(OscillatorBank, PitchAndDecayAreThoseOfTheModes) {
  const double frequency_hz = 1234.5, sigma = -7.5;
  OscillatorBank bank({.modes = {MakeMode(0, frequency_hz, sigma, 100)}}, MakeUniformShapes(1), {});
  const auto sound = Ring(bank, MakeUnitImpulse(), 24000);
  // Any x(n) = 2 Re(q) x(n-1) - |q|^2 x(n-2) for a damped sine: fit both by least squares, over a
  // long lag so that the rounding of samples does not matter.
  const size_t lag = 1000;
  double a11 = 0, a12 = 0, a22 = 0, b1 = 0, b2 = 0;
  for (size_t n = 2 * lag; n < sound.size(); ++n) {
    const double x = sound[n], x1 = sound[n - lag], x2 = sound[n - 2 * lag];
    a11 += x1 * x1, a12 += x1 * x2, a22 += x2 * x2, b1 += x * x1, b2 += x * x2;
  }
  const double determinant = a11 * a22 - a12 * a12;
  const double p = (b1 * a22 - b2 * a12) / determinant, r = (b2 * a11 - b1 * a12) / determinant;
  const double magnitude = std::sqrt(-r), t = static_cast<double>(lag) * kDt;
  EXPECT_NEAR(std::log(magnitude) / t, sigma, 1e-3 * -sigma);
  // The angle over the lag is known up to whole turns and sign.
  const double angle = std::acos(p / (2 * magnitude));
  const double right = std::remainder(2 * kPi * frequency_hz * t, 2 * kPi);
  EXPECT_NEAR(angle, std::abs(right), 1e-5 * 2 * kPi * frequency_hz * t);
}

/// The two modes of a degenerate pair, struck radially at `angle`.
std::vector<float> StrikePair(double angle, double duration_s) {
  std::vector<float> values(18, 0.0F);
  for (size_t vertex = 0; vertex < 3; ++vertex) {
    values[6 * vertex] = 1;      // mode 0 moves along x
    values[6 * vertex + 3] = 1;  // mode 1 along y
  }
  SoundingModes sounding{
      .modes = {MakeMode(0, 587.33, -0.68, 440), MakeMode(1, 587.33, -0.68, 440)}};
  sounding.modes[1].output_phase_rad = kPi / 2;
  SurfaceImpulse impulse = MakeUnitImpulse();
  impulse.impulse_newton_seconds = {static_cast<float>(std::cos(angle)),
                                    static_cast<float>(std::sin(angle)), 0};
  impulse.pulse = Pulse::RaisedCosine(static_cast<float>(duration_s));
  OscillatorBank bank(sounding, MakeShapes(values, 2), {});
  return Ring(bank, impulse, 48000);
}

TEST(OscillatorBank, LoudnessOfADegeneratePairDoesNotDependOnTheAngle) {
  double least = INFINITY, most = 0;
  for (int i = 0; i < 24; ++i) {
    const double rms = Rms(StrikePair(i * kPi / 12, 0));
    least = std::min(least, rms);
    most = std::max(most, rms);
  }
  EXPECT_LT(20 * std::log10(most / least), 0.5);
}

TEST(OscillatorBank, TheCosineOfADegeneratePairBeginsWithoutAClick) {
  // The largest second difference of a sine of amplitude A and step w = omega dt is A w^2, and A w
  // at its onset, where the slope begins. A bare cosine would begin with A, 13 times as much.
  const double step = 2 * kPi * 587.33 * kDt;
  for (const double duration_s : {0.0, 2e-3}) {
    const auto sound = StrikePair(kPi / 2, duration_s);
    const double amplitude = *std::ranges::max_element(sound);
    double roughest = std::abs(sound[0]);
    for (size_t n = 2; n < 4800; ++n) {
      roughest = std::max<double>(roughest, std::abs(sound[n] - 2 * sound[n - 1] + sound[n - 2]));
    }
    EXPECT_LT(roughest, 1.5 * amplitude * step);
  }
}

TEST(OscillatorBank, FallsSilentAndThenAddsNothing) {
  OscillatorBank bank({.modes = {MakeMode(0, 440, -700)}}, MakeUniformShapes(1), {});
  EXPECT_TRUE(bank.silent());
  TestMix test;
  bank.Strike(MakeUnitImpulse(), 0, 0, test.Begin());
  EXPECT_FALSE(bank.silent());
  EXPECT_EQ(bank.active_mode_count(), 1u);
  // 200 dB at 700 nepers a second: 0.033 s, 13 blocks.
  std::vector<float> sound(128);
  test.Render(bank, sound);
  for (int block = 1; block < 13; ++block) {
    test.Begin();
    test.Render(bank, sound);
  }
  EXPECT_TRUE(bank.silent());
  EXPECT_EQ(bank.active_mode_count(), 0u);
  test.Begin();
  test.Render(bank, sound);
  EXPECT_EQ(sound, std::vector<float>(128));
}

TEST(OscillatorBank, ModesFallAsleepOneVectorAfterAnother) {
  SoundingModes sounding;
  for (uint32_t m = 0; m < 64; ++m)
    sounding.modes.push_back(MakeMode(m, 100 + 100 * m, -1.0 - 5 * m));
  OscillatorBank bank(sounding, MakeUniformShapes(64), {});
  Ring(bank, MakeUnitImpulse(), 4800);
  const size_t soon = bank.active_mode_count();
  std::vector<float> sound(128);
  TestMix test;
  for (int block = 0; block < 300; ++block) {
    test.Begin();
    test.Render(bank, sound);
  }
  EXPECT_LE(soon, 64u);
  EXPECT_LT(bank.active_mode_count(), soon);
  EXPECT_GT(bank.active_mode_count(), 0u);
}

TEST(OscillatorBank, AStrikeThatIsNotFiniteOrOffTheBodyLeavesItAsItWas) {
  const SoundingModes sounding = MakeWideModes();
  OscillatorBank bank(sounding, MakeUniformShapes(37), {});
  TestMix test;
  BlockMix& mix = test.Begin();
  for (const float bad :
       {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(), 1e38F}) {
    SurfaceImpulse impulse = MakeUnitImpulse();
    impulse.impulse_newton_seconds[1] = bad == 1e38F ? 0 : bad;
    impulse.impulse_newton_seconds[0] = bad;
    EXPECT_FALSE(bank.Strike(impulse, 0, 0, mix));
  }
  SurfaceImpulse off = MakeUnitImpulse();
  off.at.vertices[2] = 3;
  EXPECT_FALSE(bank.Strike(off, 0, 0, mix));
  EXPECT_TRUE(bank.silent());
}

TEST(OscillatorBank, GainAndShapeScaleMultiplyTheSound) {
  const SoundingMode mode = MakeMode(0, 440, -5, 100);
  OscillatorBank plain({.modes = {mode}}, MakeUniformShapes(1), {});
  OscillatorBank loud({.modes = {mode}, .shape_scale = 3}, MakeUniformShapes(1), {.gain = 2});
  const double ratio =
      Rms(Ring(loud, MakeUnitImpulse(), 4800)) / Rms(Ring(plain, MakeUnitImpulse(), 4800));
  EXPECT_NEAR(ratio, 6, 1e-5);
}

}  // namespace
}  // namespace carillon
