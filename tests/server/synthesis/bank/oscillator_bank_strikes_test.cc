// SPDX-License-Identifier: Apache-2.0
// Impulses and knots of a bank within a block.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <initializer_list>
#include <limits>
#include <vector>

#include "server/synthesis/bank/oscillator_bank.h"
#include "tests/server/synthesis/closed_form.h"
#include "tests/server/synthesis/on_every_target.h"

namespace carillon {
namespace {

constexpr double kDt = kTestFrameS;

INSTANTIATE_TEST_SUITE_P(OscillatorBankStrikes, OnEveryTarget,
                         testing::ValuesIn(hwy::SupportedAndGeneratedTargets()),
                         [](const auto& target) { return hwy::TargetName(target.param); });

/// Unit strikes at these frames, at frame n.
auto SumOfStrikes(const SoundingModes& sounding, const std::vector<double>& strikes) {
  return [&](size_t n) {
    double sum = 0;
    for (const double strike : strikes) {
      sum += SumOfModes(sounding, 1, (static_cast<double>(n) - strike) * kDt);
    }
    return sum;
  };
}

TEST(OscillatorBankStrikes, TwoStrikesSuperpose) {
  const SoundingModes sounding = MakeWideModes();
  const SurfaceImpulse impulse = MakeUnitImpulse();
  OscillatorBank bank(sounding, MakeUniformShapes(37), {});
  std::vector<float> sound(12800);
  TestMix test;
  for (size_t block = 0; block < 100; ++block) {
    BlockMix& mix = test.Begin();
    if (block == 3) bank.Strike(impulse, 17, 0.5F, mix);
    if (block == 3) bank.Strike(impulse, 17, 0.25F, mix);
    if (block == 3) bank.Strike(impulse, 90, 0, mix);
    if (block == 40) bank.Strike(impulse, 127, 0, mix);
    bank.RenderAdd(mix);
    test.Finish(std::span(sound).subspan(128 * block, 128));
  }
  const std::vector<double> strikes = {3 * 128 + 16.5, 3 * 128 + 16.75, 3 * 128 + 90.0,
                                       40 * 128 + 127.0};
  EXPECT_LT(DeviationDb(sound, 0, 7, SumOfStrikes(sounding, strikes)), -100);
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
        bank.Strike(MakeUnitImpulse(), offset, 0, mix);
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
          bank.Strike(MakeUnitImpulse(), offset, lead, mix);
          strikes.push_back(static_cast<double>(start + offset) - lead);
        }
        test.Render(bank, std::span(sound).subspan(start, block_frame_count));
      }
      EXPECT_LT(DeviationDb(sound, 0, 5, SumOfStrikes(sounding, strikes)), -110)
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
                             {.offset = 8, .merged = true, .event = &event}};
  constexpr double kMeanFrame = 8 - 0.25;
  for (const double exact_frame : {0.0, 11.0}) {
    OscillatorBank bank(sounding, MakeUniformShapes(37), {});
    std::vector<float> sound(1024);
    TestMix test;
    for (size_t start = 0; start < sound.size(); start += 128) {
      BlockMix& mix = test.Begin();
      if (start == 0) bank.Strike(MakeUnitImpulse(), static_cast<size_t>(exact_frame), 0, mix);
      if (start == 0) bank.StrikeMerged(merged, mix);
      test.Render(bank, std::span(sound).subspan(start, 128));
    }
    const std::vector<double> strikes = {exact_frame, kMeanFrame, kMeanFrame};
    EXPECT_LT(DeviationDb(sound, 12, 1, SumOfStrikes(sounding, strikes)), -100) << exact_frame;
  }
}

TEST(OscillatorBankStrikes, ARefusedImpulseLeavesABankThatRingsBySpectrumAsItWas) {
  const SoundingModes sounding{.modes = {MakeMode(0, 440, -1)}};
  OscillatorBank bank(sounding, MakeUniformShapes(1), {}),
      undisturbed(sounding, MakeUniformShapes(1), {});
  SurfaceImpulse refused = MakeUnitImpulse();
  refused.impulse_newton_seconds[0] = std::numeric_limits<float>::infinity();
  TestMix test, undisturbed_test;
  std::vector<float> block(128), right(128);
  for (size_t number = 0; number < 64; ++number) {
    BlockMix &mix = test.Begin(), &undisturbed_mix = undisturbed_test.Begin();
    if (number == 0) bank.Strike(MakeUnitImpulse(), 0, 0, mix);
    if (number == 0) undisturbed.Strike(MakeUnitImpulse(), 0, 0, undisturbed_mix);
    // Right before the mode's second long block.
    if (number == 31) {
      EXPECT_FALSE(bank.Strike(refused, 5, 0, mix));
    }
    test.Render(bank, block);
    undisturbed_test.Render(undisturbed, right);
    EXPECT_EQ(block, right) << number;
  }
  EXPECT_GT(Rms(right), 0);
}

TEST(OscillatorBankStrikes, AGaussianContactIsTheConvolutionWithAGaussian) {
  const SoundingModes sounding{
      .modes = {MakeMode(0, 180, -60, 3), MakeMode(1, 700, -400, 4), MakeMode(2, 1500, -30, 5)}};
  const double tau_s = 0.25e-3;
  SurfaceImpulse impulse = MakeUnitImpulse();
  impulse.pulse = Pulse::Gaussian(static_cast<float>(4 * tau_s));
  OscillatorBank bank(sounding, MakeUniformShapes(3), {});
  const size_t offset = 100;
  const auto sound = Ring(bank, impulse, 4096, offset);
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

TEST(OscillatorBankStrikes, ALongContactNeverMakesAModeLouder) {
  // Damped so strongly that sigma^2 > omega^2, where the Gaussian's factor would explode.
  const SoundingModes sounding{.modes = {MakeMode(0, 30, -3000, 1)}};
  SurfaceImpulse impulse = MakeUnitImpulse();
  OscillatorBank hard(sounding, MakeUniformShapes(1), {});
  const double hard_rms = Rms(Ring(hard, impulse, 4096));
  impulse.pulse = Pulse::Gaussian(0.1F);
  OscillatorBank soft(sounding, MakeUniformShapes(1), {});
  EXPECT_LT(Rms(Ring(soft, impulse, 4096)), 2 * hard_rms);
}

}  // namespace
}  // namespace carillon
