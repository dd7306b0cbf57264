// SPDX-License-Identifier: Apache-2.0
// Ringing by spectrum, and how banks go over to it.
#include "server/synthesis/spectrum/long_block.h"

#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <map>
#include <numbers>
#include <vector>

#include "server/synthesis/spectrum/spectrum.h"
#include "server/synthesis/spectrum/spreading_kernel.h"
#include "tests/server/synthesis/closed_form.h"
#include "tests/server/synthesis/on_every_target.h"

namespace carillon {
namespace {

using Complex = std::complex<double>;
constexpr double kPi = std::numbers::pi;

/// -sigma of a T60.
double DecayOf(double t60_s) { return std::log(1000.0) / t60_s; }

/// Largest error of one mode's long block, of amplitude one, over the mode's peak in it.
double LongBlockErrorDb(double frequency_hz, double t60_s, const LongBlock& block) {
  const Complex log_q = Complex(-DecayOf(t60_s), 2 * kPi * frequency_hz) / kTestSampleRateHz;
  const Complex start = std::polar(1.0, 0.7);
  const SpreadMode mode = MakeSpreadMode(log_q, block);
  Spectrum spectrum(block);
  for (size_t k = 0; k < kSpreadBins; ++k) {
    const std::complex<float> value = std::complex<float>(start) * mode.weights[k];
    spectrum.slots()[2 * (kSpreadBins * mode.slot + k)] = value.real();
    spectrum.slots()[2 * (kSpreadBins * mode.slot + k) + 1] = value.imag();
  }
  std::vector<float> frames(block.frame_count);
  spectrum.Transform(frames);
  double error = 0;
  for (size_t n = 0; n < frames.size(); ++n) {
    const double right = (start * std::exp(log_q * static_cast<double>(n))).real();
    error = Larger(error, std::abs(frames[n] - right));
  }
  return 20 * std::log10(error);
}

TEST(Spectrum, ALongBlockIsTheClosedFormForEachModeThatIsPutThere) {
  std::map<double, int> counts;  // of modes by T60
  for (const size_t block_frame_count : {64U, 100U, 128U, 256U}) {
    for (const double t60_s : {0.02, 0.05, 0.1, 1.0, 60.0}) {
      for (const double frequency_hz : {20.0, 23.4, 440.0, 5000.3, 19999.0, 23990.0}) {
        const Complex log_q(-DecayOf(t60_s) / kTestSampleRateHz, frequency_hz);
        const auto kind = ChooseLongBlock(log_q, block_frame_count);
        if (!kind) continue;
        ++counts[t60_s];
        const LongBlock block = MakeLongBlocks(block_frame_count)[*kind];
        // What eight bins and single precision give; worst where a mode mirrors at 0 Hz.
        EXPECT_LT(LongBlockErrorDb(frequency_hz, t60_s, block), -106)
            << frequency_hz << " Hz, " << t60_s << " s, " << block.frame_count << " frames";
      }
    }
  }
  for (const double t60_s : {0.05, 0.1, 1.0, 60.0}) EXPECT_EQ(counts[t60_s], 24) << t60_s;
}

/// Modes of all kinds of long blocks, and of none.
SoundingModes MakeModesOfAllKinds() {
  SoundingModes sounding;
  for (uint32_t m = 0; m < 60; ++m) {
    const double t60_s = 0.01 * std::pow(6000.0, (m * 37 % 60) / 59.0);
    sounding.modes.push_back(MakeMode(m, 20 * std::pow(1000.0, m / 59.5), -DecayOf(t60_s), 40 + m));
  }
  sounding.modes[30].output_phase_rad = kPi / 2;
  return sounding;
}

TEST_P(OnEveryTarget, GoingOverToTheSpectrumIsNotHeardWheneverTheStrikeCame) {
  const SoundingModes sounding = MakeModesOfAllKinds();
  for (size_t stagger = 0; stagger < BlockMix::kStaggers; ++stagger) {
    OscillatorBank bank(sounding, MakeUniformShapes(60), {});
    const size_t offset = 8 * stagger;
    const auto sound = Ring(bank, MakeUnitImpulse(), 8192, offset, 0.5F, 128, stagger);
    EXPECT_FALSE(bank.out_of_spectrum());
    EXPECT_LT(ErrorDb(sound, sounding, 1, static_cast<double>(offset) - 0.5), -100);
  }
}

TEST_P(OnEveryTarget, StrikesOnABankThatRingsBySpectrumAddToIt) {
  const SoundingModes sounding = MakeModesOfAllKinds();
  OscillatorBank bank(sounding, MakeUniformShapes(60), {});
  // Single strikes, then one in each block, so that the bank leaves the spectrum, then none.
  std::vector<double> strikes = {5, 3000, 3001, 5000};
  for (int block = 50; block < 170; ++block) strikes.push_back(128 * block + block);
  bool left_spectrum = false;
  size_t next = 0;
  const auto sound = RenderBlocks(bank, 250, [&](size_t block, BlockMix& mix) {
    left_spectrum |= block > 61 && bank.out_of_spectrum();
    for (; next < strikes.size() && strikes[next] < 128 * static_cast<double>(block + 1); ++next) {
      bank.Strike(MakeUnitImpulse(), static_cast<size_t>(strikes[next]) % 128, 0, mix);
    }
  });
  EXPECT_TRUE(left_spectrum);
  EXPECT_FALSE(bank.out_of_spectrum());
  EXPECT_LT(StrikesErrorDb(sound, 0, 17, sounding, strikes), -100);
}

TEST_P(OnEveryTarget, ABankThatLeavesTheSpectrumSoundsOnAsItDid) {
  const SoundingModes sounding = MakeModesOfAllKinds();
  OscillatorBank bank(sounding, MakeUniformShapes(60), {});
  const auto sound = RenderBlocks(bank, 40, [&](size_t block, BlockMix& mix) {
    if (block == 0) bank.Strike(MakeUnitImpulse(), 0, 0, mix);
    if (block == 20) bank.LeaveSpectrum();
  });
  EXPECT_TRUE(bank.out_of_spectrum());
  EXPECT_LT(ErrorDb(sound, sounding, 1, 0), -100);
}

}  // namespace
}  // namespace carillon
