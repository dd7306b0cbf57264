// SPDX-License-Identifier: Apache-2.0
#include "server/synthesis/bank/oscillator_bank.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <initializer_list>
#include <limits>
#include <numbers>
#include <numeric>
#include <random>
#include <vector>

#include "tests/server/synthesis/closed_form.h"
#include "tests/server/synthesis/on_every_target.h"

namespace carillon {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kDt = kTestFrameS;

TEST_P(OnEveryTarget, StaysWithin100DecibelsOfTheClosedFormForTenSeconds) {
  const SoundingModes sounding = MakeWideModes();
  OscillatorBank bank(sounding, MakeUniformShapes(37), {});
  const auto sound = Ring(bank, MakeUnitImpulse(), 480000);
  EXPECT_LT(ErrorDb(sound, sounding, 1, 0), -100);
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
  const auto projected = [&](size_t n) {
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
    return right;
  };
  EXPECT_LT(DeviationDb(sound, 0, 1, projected), -100);
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

  static TrianglePoint At(uint32_t vertex) {
    return {.vertices = {vertex, vertex, vertex}, .weights = {1, 0, 0}};
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
      SurfaceImpulse impulse = MakeUnitImpulse();
      impulse.at = Multiplet::At(vertex);
      EXPECT_NEAR(Rms(Ring(bank, impulse, 24000)) / right, 1, 1e-3) << vertex;
      EXPECT_EQ(bank.mode_count(), mode_count + 1);
      EXPECT_EQ(bank.active_mode_count(), mode_count + 1);
    }
  }
}

TEST(OscillatorBank, ARoughForceDrivesAMultipletEquallyWhereverItActs) {
  const auto slide = [](uint32_t mode_count, uint32_t vertex) {
    const Multiplet multiplet(mode_count);
    OscillatorBank bank(multiplet.sounding, multiplet.shapes, {});
    return Rms(RenderBlocks(bank, 188, [&](size_t, BlockMix& mix) {
      bank.AddForce({.at = Multiplet::At(vertex), .force_newtons = {1, 0, 0}});
      bank.ApplyKnot({.step_s = 128 / 48000.0F, .roughness = 0.3F, .bandwidth_hz = 4000}, 0, mix);
    }));
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

TEST(OscillatorBank, GainsOfTheOctavesOfABlowOfTheShapesAndOfTheBankMultiply) {
  const SoundingModes sounding{.modes = {MakeMode(0, 440, -5), MakeMode(1, 3000, -20)},
                               .shape_scale = 3};
  SurfaceImpulse impulse = MakeUnitImpulse();
  impulse.gains.SetDb(OctaveGains::OctaveOf(440), -20);
  impulse.gains.SetDb(OctaveGains::OctaveOf(3000), 6);
  OscillatorBank bank(sounding, MakeUniformShapes(2), {.gain = 2});
  const std::vector<float> sound = Ring(bank, impulse, 24000);
  const auto right = [&](size_t n) {
    const double time_s = static_cast<double>(n) * kDt;
    return 6 * (0.1 * ClosedForm(sounding.modes[0], 1, time_s) +
                std::pow(10, 0.3) * ClosedForm(sounding.modes[1], 1, time_s));
  };
  EXPECT_LT(DeviationDb(sound, 0, 1, right), -100);
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
  test.RenderOn(bank, 12);
  EXPECT_TRUE(bank.silent());
  EXPECT_EQ(bank.active_mode_count(), 0u);
  EXPECT_EQ(test.RenderOn(bank, 1), std::vector<float>(128));
}

TEST(OscillatorBank, ModesFallAsleepOneVectorAfterAnother) {
  SoundingModes sounding;
  for (uint32_t m = 0; m < 64; ++m) {
    sounding.modes.push_back(MakeMode(m, 100 + 100 * m, -1.0 - 5 * m));
  }
  OscillatorBank bank(sounding, MakeUniformShapes(64), {});
  Ring(bank, MakeUnitImpulse(), 4800);
  const size_t soon = bank.active_mode_count();
  TestMix().RenderOn(bank, 300);
  EXPECT_LE(soon, 64u);
  EXPECT_LT(bank.active_mode_count(), soon);
  EXPECT_GT(bank.active_mode_count(), 0u);
}

/// More than fit into a batch: the block is rendered in parts, which end where strikes are, on the
/// tiles of the kernel and between them.
TEST_P(OnEveryTarget, ManyStrikesInABlockSuperpose) {
  constexpr size_t kStrikes = 3 * StrikeBatch::kMostStrikes;
  const SoundingModes sounding = MakeWideModes();
  for (const size_t offset : {0U, 8U, 77U, 127U}) {
    OscillatorBank bank(sounding, MakeUniformShapes(37), {});
    const auto sound = RenderBlocks(bank, 4, [&](size_t block, BlockMix& mix) {
      for (size_t i = 0; block == 1 && i < kStrikes; ++i) {
        bank.Strike(MakeUnitImpulse(), offset, 0, mix);
      }
    });
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
      std::vector<double> strikes;
      const auto strike = [&, due = due_count, count = strike_count](size_t block, BlockMix& mix) {
        mix.batch().due_count = due;
        for (size_t i = 0; block <= 2 && i < count; ++i) {
          const size_t offset = (i + 1) * (block_frame_count - 1) / count;
          const float lead = i % 2 == 0 ? 0.3F : 0;
          bank.Strike(MakeUnitImpulse(), offset, lead, mix);
          strikes.push_back(static_cast<double>(block * block_frame_count + offset) - lead);
        }
      };
      const auto sound = RenderBlocks(bank, 6, strike, block_frame_count);
      EXPECT_LT(StrikesErrorDb(sound, 0, 5, sounding, strikes), -110)
          << strike_count << " strikes in blocks of " << block_frame_count;
    }
  }
}

TEST_P(OnEveryTarget, LateInALongBlockAStrikeBetweenSamplesIsAsExactAsEarly) {
  const SoundingModes sounding{.modes = {MakeMode(0, 19000, -5, 40)}};
  for (const size_t offset : {0U, 255U}) {
    OscillatorBank bank(sounding, MakeUniformShapes(1), {.block_frame_count = 256});
    const auto sound = Ring(bank, MakeUnitImpulse(), 1024, offset, 0.3F, 256);
    EXPECT_LT(ErrorDb(sound, sounding, 1, static_cast<double>(offset) - double{0.3F}), -110);
  }
}

/// A contact that takes time reaches into tiles, too.
TEST_P(OnEveryTarget, AContactThatTakesTimeRingsInTilesOfAllKinds) {
  const SoundingModes sounding = MakeModesOfAllTiles();
  for (const size_t offset : {0U, 50U, 127U}) {
    OscillatorBank bank(sounding, MakeUniformShapes(sounding.modes.size()), {});
    SurfaceImpulse impulse = MakeUnitImpulse();
    impulse.pulse = Pulse::Gaussian(4e-4F);
    const auto sound = Ring(bank, impulse, 1024, offset, 0.25F);
    EXPECT_LT(ErrorDb(std::vector(sound.begin() + static_cast<ptrdiff_t>(offset), sound.end()),
                      sounding, 1, -0.25, 1e-4F),
              -110)
        << offset;
  }
}

TEST_P(OnEveryTarget, MergedStrikesSoundAtTheirMeanTimeWhateverCameBefore) {
  const SoundingModes sounding = MakeWideModes();
  const MixerEvent event{.fraction = 0.75F, .action = MakeUnitImpulse()};
  const DueEvent merged[] = {{.offset = 8, .merged = true, .event = &event},
                             {.offset = 11, .merged = true, .event = &event}};
  constexpr double kMeanFrame = 9.5 - 0.25;
  for (const double exact_frame : {0.0, 11.0}) {
    OscillatorBank bank(sounding, MakeUniformShapes(37), {});
    const auto sound = RenderBlocks(bank, 8, [&](size_t block, BlockMix& mix) {
      if (block > 0) return;
      bank.Strike(MakeUnitImpulse(), static_cast<size_t>(exact_frame), 0, mix);
      bank.StrikeMerged(merged, mix);
    });
    const std::vector<double> strikes = {exact_frame, kMeanFrame, kMeanFrame};
    EXPECT_LT(StrikesErrorDb(sound, 12, 1, sounding, strikes), -100) << exact_frame;
  }
}

TEST(OscillatorBank, AnImpulseThatIsNotFiniteOrOffTheBodyLeavesABankAsItWas) {
  const SoundingModes sounding = MakeWideModes();
  OscillatorBank bank(sounding, MakeUniformShapes(37), {}),
      undisturbed(sounding, MakeUniformShapes(37), {});
  std::vector<SurfaceImpulse> refused(4, MakeUnitImpulse());
  refused[0].impulse_newton_seconds[1] = std::numeric_limits<float>::quiet_NaN();
  refused[1].impulse_newton_seconds[0] = std::numeric_limits<float>::infinity();
  refused[2].impulse_newton_seconds[0] = 1e38F;
  refused[3].at.vertices[2] = 3;
  const auto right = Ring(undisturbed, MakeUnitImpulse(), size_t{64} * 128);
  const auto sound = RenderBlocks(bank, 64, [&](size_t block, BlockMix& mix) {
    // While the bank is silent, and right before the second long block of its slowest modes.
    for (const SurfaceImpulse& impulse : refused) {
      if (block == 0 || block == 31) {
        EXPECT_FALSE(bank.Strike(impulse, 5, 0, mix));
        EXPECT_EQ(bank.silent(), block == 0);
      }
    }
    if (block == 0) bank.Strike(MakeUnitImpulse(), 0, 0, mix);
  });
  EXPECT_EQ(sound, right);
  EXPECT_GT(Rms(right), 0);
}

TEST(OscillatorBank, AGaussianContactIsTheConvolutionWithAGaussian) {
  const SoundingModes sounding{
      .modes = {MakeMode(0, 180, -60, 3), MakeMode(1, 700, -400, 4), MakeMode(2, 1500, -30, 5)}};
  const double tau_s = 0.25e-3;
  SurfaceImpulse impulse = MakeUnitImpulse();
  impulse.pulse = Pulse::Gaussian(static_cast<float>(4 * tau_s));
  OscillatorBank bank(sounding, MakeUniformShapes(3), {});
  const size_t offset = 100;
  const auto sound = Ring(bank, impulse, 4096, offset);
  // The closed form holds once the contact is over: from 6 tau on, where its tail is below 1e-8.
  const auto over = static_cast<size_t>(6 * tau_s / kTestFrameS) + 1;
  const auto convolved = [&](size_t n) {
    const double time_s = static_cast<double>(n - offset) * kTestFrameS;
    double right = 0, weight_sum = 0;
    for (int i = -60; i <= 60; ++i) {  // the sum over a Gaussian converges at once
      const double weight = std::exp(-0.5 * i * i / 100);
      weight_sum += weight;
      right += weight * SumOfModes(sounding, 1, time_s - i * tau_s / 10);
    }
    return right / weight_sum;
  };
  EXPECT_LT(DeviationDb(sound, offset + over, 13, convolved), -100);
}

}  // namespace
}  // namespace carillon
