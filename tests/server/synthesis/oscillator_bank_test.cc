// SPDX-License-Identifier: Apache-2.0
#include "server/synthesis/oscillator_bank.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <complex>
#include <initializer_list>
#include <limits>
#include <numbers>
#include <vector>

#include "tests/server/synthesis/closed_form.h"
#include "tests/server/synthesis/on_every_target.h"

namespace carillon {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kDt = kTestFrameS;

/// Modes over the whole band and all kinds of decay; more than a vector of them, not a multiple.
SoundingModes MakeWideModes() {
  SoundingModes sounding;
  for (uint32_t m = 0; m < 37; ++m) {
    const double frequency_hz = 20 * std::pow(1000.0, m / 36.5);
    sounding.modes.push_back(MakeMode(m, frequency_hz, m % 3 == 0 ? -0.2 : -0.5 * (m + 1), 40 + m));
  }
  return sounding;
}

INSTANTIATE_TEST_SUITE_P(OscillatorBank, OnEveryTarget,
                         testing::ValuesIn(hwy::SupportedAndGeneratedTargets()),
                         [](const auto& target) { return hwy::TargetName(target.param); });

TEST_P(OnEveryTarget, StaysWithin100DecibelsOfTheClosedFormForTenSeconds) {
  const SoundingModes sounding = MakeWideModes();
  OscillatorBank bank(sounding, MakeUniformShapes(37), {});
  const auto sound = Ring(bank, MakeUnitExcitation(), 480000);
  const double error_db = ErrorDb(sound, sounding, 1, 0);
  RecordProperty("error_db", std::to_string(error_db));
  EXPECT_LT(error_db, -100);
}

TEST_P(OnEveryTarget, StartsAtAnySampleAndBetweenSamples) {
  const SoundingModes sounding = MakeWideModes();
  for (const size_t offset : {size_t{0}, size_t{1}, size_t{77}, size_t{127}}) {
    for (const float lead : {0.0F, 0.25F, 0.875F}) {
      OscillatorBank bank(sounding, MakeUniformShapes(37), {});
      const auto sound = Ring(bank, MakeUnitExcitation(), 512, offset, lead);
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
  const Excitation excitation{.vertices = {2, 0, 1},
                              .weights = {0.2F, 0.5F, 0.3F},
                              .impulse_newton_seconds = {0.1F, -0.7F, 0.4F}};
  OscillatorBank bank(sounding, MakeShapes(values, mode_count), {});
  const auto sound = Ring(bank, excitation, 1024);
  double error = 0, peak = 0;
  for (size_t n = 0; n < sound.size(); ++n) {
    double right = 0;
    for (const SoundingMode& mode : sounding.modes) {
      double g = 0;
      for (size_t i = 0; i < 3; ++i) {
        for (size_t axis = 0; axis < 3; ++axis) {
          g += double{excitation.weights[i]} * excitation.impulse_newton_seconds[axis] *
               values[(3 * excitation.vertices[i] + axis) * mode_count + mode.column];
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
  EXPECT_EQ(Ring(one, MakeUnitExcitation(), 4096, 5, 0.5F),
            Ring(two, MakeUnitExcitation(), 4096, 5, 0.5F));
}

TEST(OscillatorBank, PitchAndDecayAreThoseOfTheModes) {
  const double frequency_hz = 1234.5, sigma = -7.5;
  OscillatorBank bank({.modes = {MakeMode(0, frequency_hz, sigma, 100)}}, MakeUniformShapes(1), {});
  const auto sound = Ring(bank, MakeUnitExcitation(), 24000);
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

TEST(OscillatorBank, TwoStrikesSuperpose) {
  const SoundingModes sounding = MakeWideModes();
  const Excitation excitation = MakeUnitExcitation();
  OscillatorBank bank(sounding, MakeUniformShapes(37), {});
  std::vector<float> sound(12800);
  TestMix test;
  for (size_t block = 0; block < 100; ++block) {
    BlockMix& mix = test.Begin();
    if (block == 3) bank.Strike(excitation, 17, 0.5F, mix);
    if (block == 3) bank.Strike(excitation, 17, 0.25F, mix);
    if (block == 3) bank.Strike(excitation, 90, 0, mix);
    if (block == 40) bank.Strike(excitation, 127, 0, mix);
    bank.RenderAdd(mix);
    test.Finish(std::span(sound).subspan(128 * block, 128));
  }
  double error = 0, peak = 0;
  for (size_t n = 0; n < sound.size(); n += 7) {
    double right = 0;
    for (const double strike :
         {3 * 128 + 16.5, 3 * 128 + 16.75, 3 * 128 + 90.0, 40 * 128 + 127.0}) {
      right += SumOfModes(sounding, 1, (static_cast<double>(n) - strike) * kDt);
    }
    error = std::max(error, std::abs(sound[n] - right));
    peak = std::max(peak, std::abs(right));
  }
  EXPECT_LT(20 * std::log10(error / peak), -100);
}

/// More than fit into a batch: the block is rendered in parts, which end where strikes are, on the
/// tiles of the kernel and between them.
TEST_P(OnEveryTarget, ManyStrikesInABlockSuperpose) {
  constexpr size_t kStrikes = 3 * StrikeBatch::kMostStrikes;
  const SoundingModes sounding = MakeWideModes();
  for (const size_t offset : {0U, 8U, 77U, 127U}) {
    OscillatorBank bank(sounding, MakeUniformShapes(37), {});
    std::vector<float> sound(512);
    TestMix test;
    for (size_t start = 0; start < sound.size(); start += 128) {
      BlockMix& mix = test.Begin();
      for (size_t i = 0; start == 128 && i < kStrikes; ++i) {
        bank.Strike(MakeUnitExcitation(), offset, 0, mix);
      }
      test.Render(bank, std::span(sound).subspan(start, 128));
    }
    EXPECT_LT(ErrorDb(sound, sounding, kStrikes, static_cast<double>(128 + offset)), -100)
        << offset;
  }
}

/// Whole vectors of modes for each kind of tile, and some more of each.
SoundingModes MakeModesOfAllTiles() {
  SoundingModes sounding;
  for (const double lowest_hz : {40.0, 700.0, 4000.0}) {
    for (int m = 0; m < 37; ++m) {
      const auto column = static_cast<uint32_t>(sounding.modes.size());
      sounding.modes.push_back(
          MakeMode(column, lowest_hz * std::pow(3.1, m / 36.5), -0.5 - 1.5 * m, 40 + m));
    }
  }
  return sounding;
}

/// With blocks that are whole tiles and such that are not, few strikes and many, which go frame by
/// frame if that was told, in parts of a block.
TEST_P(OnEveryTarget, StrikesInAndBetweenTilesOfAllKindsSuperpose) {
  const SoundingModes sounding = MakeModesOfAllTiles();
  const size_t mode_count = sounding.modes.size();
  for (const size_t block_frame_count : {128U, 48U, 100U, 256U}) {
    for (const auto [strike_count, due_count] :
         std::initializer_list<std::array<size_t, 2>>{{1, 1}, {3, 3}, {40, 40}, {40, 1}}) {
      OscillatorBank bank(sounding, MakeUniformShapes(mode_count),
                          {.block_frame_count = block_frame_count});
      std::vector<float> sound(6 * block_frame_count);
      std::vector<double> strikes;
      TestMix test(block_frame_count);
      for (size_t start = 0; start < sound.size(); start += block_frame_count) {
        BlockMix& mix = test.Begin();
        mix.batch().due_count = due_count;
        for (size_t i = 0; start <= 2 * block_frame_count && i < strike_count; ++i) {
          const size_t offset = (i + 1) * (block_frame_count - 1) / strike_count;
          const float lead = i % 2 == 0 ? 0.3F : 0;
          bank.Strike(MakeUnitExcitation(), offset, lead, mix);
          strikes.push_back(static_cast<double>(start + offset) - lead);
        }
        test.Render(bank, std::span(sound).subspan(start, block_frame_count));
      }
      double error = 0, peak = 0;
      for (size_t n = 0; n < sound.size(); n += 5) {
        double right = 0;
        for (const double strike : strikes) {
          right += SumOfModes(sounding, 1, (static_cast<double>(n) - strike) * kDt);
        }
        error = std::max(error, std::abs(sound[n] - right));
        peak = std::max(peak, std::abs(right));
      }
      EXPECT_LT(20 * std::log10(error / peak), -110)
          << strike_count << " strikes in blocks of " << block_frame_count;
    }
  }
}

TEST_P(OnEveryTarget, LateInALongBlockAStrikeBetweenSamplesIsAsExactAsEarly) {
  const SoundingModes sounding{.modes = {MakeMode(0, 19000, -5, 40)}};
  for (const size_t offset : {0U, 255U}) {
    OscillatorBank bank(sounding, MakeUniformShapes(1), {.block_frame_count = 256});
    const auto sound = Ring(bank, MakeUnitExcitation(), 1024, offset, 0.3F, 256);
    EXPECT_LT(ErrorDb(sound, sounding, 1, static_cast<double>(offset) - double{0.3F}), -110);
  }
}

/// A contact that takes time reaches into tiles, too.
TEST_P(OnEveryTarget, AContactThatTakesTimeRingsInTilesOfAllKinds) {
  const SoundingModes sounding = MakeModesOfAllTiles();
  for (const size_t offset : {0U, 50U, 127U}) {
    OscillatorBank bank(sounding, MakeUniformShapes(sounding.modes.size()), {});
    Excitation excitation = MakeUnitExcitation();
    excitation.tau_s = 1e-4F;
    const auto sound = Ring(bank, excitation, 1024, offset, 0.25F);
    EXPECT_LT(ErrorDb(std::vector(sound.begin() + static_cast<ptrdiff_t>(offset), sound.end()),
                      sounding, 1, -0.25, excitation.tau_s),
              -110)
        << offset;
  }
}

TEST_P(OnEveryTarget, MergedStrikesSoundAtTheirMeanTimeWhateverCameBefore) {
  const SoundingModes sounding = MakeWideModes();
  PendingStrike pending{.lead_frames = 0.25F, .excitation = MakeUnitExcitation()};
  const DueStrike merged[] = {{.offset = 8, .merged = true, .strike = &pending},
                              {.offset = 8, .merged = true, .strike = &pending}};
  constexpr double kMeanFrame = 8 - 0.25;
  for (const double exact_frame : {0.0, 11.0}) {
    OscillatorBank bank(sounding, MakeUniformShapes(37), {});
    std::vector<float> sound(1024);
    TestMix test;
    for (size_t start = 0; start < sound.size(); start += 128) {
      BlockMix& mix = test.Begin();
      if (start == 0) bank.Strike(MakeUnitExcitation(), static_cast<size_t>(exact_frame), 0, mix);
      if (start == 0) bank.StrikeMerged(merged, mix);
      test.Render(bank, std::span(sound).subspan(start, 128));
    }
    double error = 0, peak = 0;
    for (size_t n = 12; n < sound.size(); ++n) {
      const auto frame = static_cast<double>(n);
      const double right = SumOfModes(sounding, 1, (frame - exact_frame) * kDt) +
                           SumOfModes(sounding, 2, (frame - kMeanFrame) * kDt);
      error = std::max(error, std::abs(sound[n] - right));
      peak = std::max(peak, std::abs(right));
    }
    EXPECT_LT(20 * std::log10(error / peak), -100) << exact_frame;
  }
}

TEST(OscillatorBank, MergedStrikesThatAreNotFiniteLeaveItAsItWas) {
  const SoundingModes sounding = MakeWideModes();
  OscillatorBank bank(sounding, MakeUniformShapes(37), {}),
      fresh(sounding, MakeUniformShapes(37), {});
  PendingStrike pending{.excitation = MakeUnitExcitation()};
  pending.excitation.impulse_newton_seconds[0] = std::numeric_limits<float>::infinity();
  const DueStrike merged[] = {{.offset = 8, .merged = true, .strike = &pending},
                              {.offset = 9, .merged = true, .strike = &pending}};
  std::vector<float> block(128), right(128);
  TestMix test, fresh_test;
  BlockMix &mix = test.Begin(), &fresh_mix = fresh_test.Begin();
  // As many as fit: one more would render what is there first.
  for (size_t i = 0; i < StrikeBatch::kMostStrikes; ++i) {
    bank.Strike(MakeUnitExcitation(), 5, 0, mix);
    fresh.Strike(MakeUnitExcitation(), 5, 0, fresh_mix);
  }
  EXPECT_FALSE(bank.StrikeMerged(merged, mix));
  test.Render(bank, block);
  fresh_test.Render(fresh, right);
  EXPECT_EQ(block, right);
}

TEST(OscillatorBank, AForceThatIsNotFiniteLeavesASilentBankAsItWas) {
  const SoundingModes sounding = MakeWideModes();
  OscillatorBank bank(sounding, MakeUniformShapes(37), {}),
      fresh(sounding, MakeUniformShapes(37), {});
  TestMix test;
  std::vector<float> block(128);
  Excitation force = MakeUnitExcitation();
  force.impulse_newton_seconds[0] = std::numeric_limits<float>::infinity();
  BlockMix& mix = test.Begin();
  EXPECT_TRUE(bank.Gather(force));
  EXPECT_FALSE(bank.Tie({.step_s = 0.01F}, 50, mix));
  EXPECT_TRUE(bank.silent());
  test.Finish(block);
  EXPECT_EQ(Ring(bank, MakeUnitExcitation(), 1024, 5), Ring(fresh, MakeUnitExcitation(), 1024, 5));
}

TEST(OscillatorBank, AGaussianContactIsTheConvolutionWithAGaussian) {
  const SoundingModes sounding{
      .modes = {MakeMode(0, 180, -60, 3), MakeMode(1, 700, -400, 4), MakeMode(2, 1500, -30, 5)}};
  const double tau_s = 0.25e-3;
  Excitation excitation = MakeUnitExcitation();
  excitation.tau_s = static_cast<float>(tau_s);
  OscillatorBank bank(sounding, MakeUniformShapes(3), {});
  const size_t offset = 100;
  const auto sound = Ring(bank, excitation, 4096, offset);
  double error = 0, peak = 0;
  // The closed form holds once the contact is over: from 6 tau on, where its tail is below 1e-8.
  const auto over = static_cast<size_t>(6 * tau_s / kDt) + 1;
  for (size_t n = offset + over; n < sound.size(); n += 13) {
    const double time_s = static_cast<double>(n - offset) * kDt;
    double right = 0, weight_sum = 0;
    for (int i = -60; i <= 60; ++i) {  // the sum over a Gaussian converges at once
      const double weight = std::exp(-0.5 * i * i / 100);
      weight_sum += weight;
      right += weight * SumOfModes(sounding, 1, time_s - i * tau_s / 10);
    }
    right /= weight_sum;
    error = std::max(error, std::abs(sound[n] - right));
    peak = std::max(peak, std::abs(right));
  }
  EXPECT_LT(20 * std::log10(error / peak), -100);
}

TEST(OscillatorBank, ALongContactNeverMakesAModeLouder) {
  // Damped so strongly that sigma^2 > omega^2, where the Gaussian's factor would explode.
  const SoundingModes sounding{.modes = {MakeMode(0, 30, -3000, 1)}};
  Excitation excitation = MakeUnitExcitation();
  OscillatorBank hard(sounding, MakeUniformShapes(1), {});
  const double hard_rms = Rms(Ring(hard, excitation, 4096));
  excitation.tau_s = 0.025F;
  OscillatorBank soft(sounding, MakeUniformShapes(1), {});
  EXPECT_LT(Rms(Ring(soft, excitation, 4096)), 2 * hard_rms);
}

/// The two modes of a degenerate pair, struck radially at `angle`.
std::vector<float> StrikePair(double angle, double tau_s) {
  std::vector<float> values(18, 0.0F);
  for (size_t vertex = 0; vertex < 3; ++vertex) {
    values[6 * vertex] = 1;      // mode 0 moves along x
    values[6 * vertex + 3] = 1;  // mode 1 along y
  }
  SoundingModes sounding{
      .modes = {MakeMode(0, 587.33, -0.68, 440), MakeMode(1, 587.33, -0.68, 440)}};
  sounding.modes[1].output_phase_rad = kPi / 2;
  Excitation excitation = MakeUnitExcitation();
  excitation.impulse_newton_seconds = {static_cast<float>(std::cos(angle)),
                                       static_cast<float>(std::sin(angle)), 0};
  excitation.tau_s = static_cast<float>(tau_s);
  OscillatorBank bank(sounding, MakeShapes(values, 2), {});
  return Ring(bank, excitation, 48000);
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
  for (const double tau_s : {0.0, 0.5e-3}) {
    const auto sound = StrikePair(kPi / 2, tau_s);
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
  bank.Strike(MakeUnitExcitation(), 0, 0, test.Begin());
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
  Ring(bank, MakeUnitExcitation(), 4800);
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
    Excitation excitation = MakeUnitExcitation();
    excitation.impulse_newton_seconds[1] = bad == 1e38F ? 0 : bad;
    excitation.impulse_newton_seconds[0] = bad;
    EXPECT_FALSE(bank.Strike(excitation, 0, 0, mix));
  }
  Excitation off = MakeUnitExcitation();
  off.vertices[2] = 3;
  EXPECT_FALSE(bank.Strike(off, 0, 0, mix));
  EXPECT_TRUE(bank.silent());
}

TEST(OscillatorBank, GainAndShapeScaleMultiplyTheSound) {
  const SoundingMode mode = MakeMode(0, 440, -5, 100);
  OscillatorBank plain({.modes = {mode}}, MakeUniformShapes(1), {});
  OscillatorBank loud({.modes = {mode}, .shape_scale = 3}, MakeUniformShapes(1), {.gain = 2});
  const double ratio =
      Rms(Ring(loud, MakeUnitExcitation(), 4800)) / Rms(Ring(plain, MakeUnitExcitation(), 4800));
  EXPECT_NEAR(ratio, 6, 1e-5);
}

}  // namespace
}  // namespace carillon
