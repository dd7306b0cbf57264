// SPDX-License-Identifier: Apache-2.0
#include "server/synthesis/bank/oscillator_bank.h"

#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <limits>
#include <numbers>
#include <numeric>
#include <random>
#include <span>
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

/// A multiplet of `mode_count` modes at one frequency and one single mode. Along x, the modes of
/// the multiplet move each vertex by a vector of unit length, in random directions of the
/// multiplet.
struct Multiplet {
  explicit Multiplet(uint32_t mode_count) {
    std::mt19937 random(mode_count);
    std::normal_distribution<double> normal;
    const size_t columns = mode_count + 1;
    std::vector<float> values(kVertices * 3 * columns);
    for (size_t vertex = 0; vertex < kVertices; ++vertex) {
      std::vector<double> row(mode_count);
      for (double& value : row) value = normal(random);
      const double norm = std::sqrt(std::inner_product(row.begin(), row.end(), row.begin(), 0.0));
      for (size_t m = 0; m < mode_count; ++m) {
        values[3 * vertex * columns + m] = static_cast<float>(row[m] / norm);
      }
    }
    shapes = ShapeTable(values, kVertices, columns);
    for (uint32_t m = 0; m < mode_count; ++m) {
      sounding.modes.push_back(MakeMode(m, 587.33, -5, 440));
      sounding.modes.back().multiplet = 1;
    }
    sounding.modes.push_back(MakeMode(mode_count, 1000, -5, 440));
  }

  static SurfaceImpulse At(uint32_t vertex, float newton_seconds = 1) {
    return {.at = {.vertices = {vertex, vertex, vertex}, .weights = {1, 0, 0}},
            .impulse_newton_seconds = {newton_seconds, 0, 0}};
  }

  static constexpr uint32_t kVertices = 14;
  ShapeTable shapes;
  SoundingModes sounding{};
};

TEST(OscillatorBank, AMultipletSoundsAsLoudAsAModeOfItsPowerWhereverItIsStruck) {
  OscillatorBank single({.modes = {MakeMode(0, 587.33, -5, 440)}}, MakeUniformShapes(1), {});
  const double right = Rms(Ring(single, MakeUnitImpulse(), 24000));
  for (const uint32_t mode_count : {3U, 5U, 7U}) {
    const Multiplet multiplet(mode_count);
    for (uint32_t vertex = 0; vertex < Multiplet::kVertices; ++vertex) {
      OscillatorBank bank(multiplet.sounding, multiplet.shapes, {});
      EXPECT_NEAR(Rms(Ring(bank, Multiplet::At(vertex), 24000)) / right, 1, 1e-3) << vertex;
      EXPECT_EQ(bank.mode_count(), mode_count + 1);
      EXPECT_EQ(bank.active_mode_count(), mode_count + 1);
    }
  }
}

TEST(OscillatorBank, ARoughForceDrivesAMultipletEquallyWhereverItActs) {
  const auto slide = [](uint32_t mode_count, uint32_t vertex) {
    const Multiplet multiplet(mode_count);
    OscillatorBank bank(multiplet.sounding, multiplet.shapes, {});
    TestMix test;
    std::vector<float> sound(24064);
    for (size_t start = 0; start < sound.size(); start += 128) {
      BlockMix& mix = test.Begin();
      bank.AddForce({.at = {.vertices = {vertex, vertex, vertex}, .weights = {1, 0, 0}},
                     .force_newtons = {1, 0, 0}});
      bank.ApplyKnot({.step_s = 128 / 48000.0F, .roughness = 0.3F, .bandwidth_hz = 4000}, 0, mix);
      test.Render(bank, std::span(sound).subspan(start, 128));
    }
    return Rms(sound);
  };
  const double right = slide(3, 0);
  EXPECT_GT(right, 0);
  for (const uint32_t vertex : {1U, 2U, 3U}) {
    EXPECT_NEAR(slide(3, vertex) / right, 1, 1e-3);
    EXPECT_NEAR(slide(7, vertex) / right, 1, 1e-3);
  }
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

TEST(OscillatorBank, EachOctaveOfABlowHasItsGain) {
  const SoundingModes sounding{.modes = {MakeMode(0, 440, -5), MakeMode(1, 3000, -20)}};
  SurfaceImpulse impulse = MakeUnitImpulse();
  impulse.gains.SetDb(OctaveGains::OctaveOf(440), -20);
  impulse.gains.SetDb(OctaveGains::OctaveOf(3000), 6);
  OscillatorBank bank(sounding, MakeUniformShapes(2), {});
  const std::vector<float> sound = Ring(bank, impulse, 24000);
  const auto right = [&](size_t n) {
    const double time_s = static_cast<double>(n) * kDt;
    return 0.1 * ClosedForm(sounding.modes[0], 1, time_s) +
           std::pow(10, 0.3) * ClosedForm(sounding.modes[1], 1, time_s);
  };
  EXPECT_LT(DeviationDb(sound, 0, 1, right), -80);
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
