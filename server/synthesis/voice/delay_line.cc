// SPDX-License-Identifier: Apache-2.0
#include "server/synthesis/voice/delay_line.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <numbers>

namespace carillon {
namespace {

constexpr size_t kTaps = DelayLine::kTaps;
constexpr size_t kPhases = 512;
/// Shape of the Kaiser window: side lobes at -80 dB.
constexpr double kBeta = 7.86;

/// Coefficients for positions `phase`/kPhases after the middle tap, ascending in time.
using PhaseTable = std::array<std::array<float, kTaps>, kPhases + 1>;

double Kaiser(double x) {
  return std::cyl_bessel_i(0, kBeta * std::sqrt(std::fmax(0, 1 - x * x))) /
         std::cyl_bessel_i(0, kBeta);
}

PhaseTable MakePhaseTable() {
  PhaseTable table{};
  for (size_t phase = 0; phase <= kPhases; ++phase) {
    for (size_t tap = 0; tap < kTaps; ++tap) {
      const double x =
          static_cast<double>(tap) - (kTaps / 2.0 - 1) - static_cast<double>(phase) / kPhases;
      const bool whole = phase % kPhases == 0;
      const double sinc = std::sin(std::numbers::pi * x) / (std::numbers::pi * x);
      // A whole position takes exactly one sample.
      const double at_sample = std::abs(x) < 0.5 ? 1 : 0;
      table[phase][tap] = static_cast<float>(whole ? at_sample : sinc * Kaiser(x / (kTaps / 2.0)));
    }
  }
  return table;
}

/// The table is computed when the first delay line is made, which is never on a rendering thread.
const float* Phases() {
  static const PhaseTable table = MakePhaseTable();
  return table.front().data();
}

}  // namespace

DelayLine::DelayLine(size_t longest_delay, size_t block_frame_count)
    : mask_(std::bit_ceil(longest_delay + block_frame_count + kTaps) - 1),
      samples_(mask_ + 1 + kTaps),
      phases_(Phases()) {}

void DelayLine::Write(std::span<const float> samples) noexcept {
  for (const float sample : samples) {
    const size_t at = written_++ & mask_;
    samples_[at] = sample;
    if (at < kTaps) samples_[mask_ + 1 + at] = sample;
  }
}

float DelayLine::Read(double delay) const noexcept {
  const double whole = std::ceil(delay);
  const double phase = (whole - delay) * kPhases;
  const auto row = static_cast<size_t>(phase);
  const auto part = static_cast<float>(phase - static_cast<double>(row));
  const float* below = phases_ + row * kTaps;
  const float* above = below + kTaps;
  // `begin` is below zero until enough samples have been written.
  const auto begin =
      static_cast<ptrdiff_t>(written_ - static_cast<size_t>(whole) - (kTaps / 2 - 1));
  const auto silent = static_cast<size_t>(std::clamp<ptrdiff_t>(
      static_cast<ptrdiff_t>(silent_count_) - begin, 0, static_cast<ptrdiff_t>(kTaps)));
  const float* samples = samples_.data() + (static_cast<size_t>(begin) & mask_);
  std::array<float, kTaps> heard;
  if (silent > 0) {
    std::fill_n(heard.begin(), silent, 0.0F);
    std::copy(samples + silent, samples + kTaps, heard.data() + silent);
    samples = heard.data();
  }
  std::array<float, 4> sum{};
  for (size_t tap = 0; tap < kTaps; tap += 4) {
    for (size_t i = 0; i < 4; ++i) {
      const float low = below[tap + i], high = above[tap + i];
      sum[i] += samples[tap + i] * (low + part * (high - low));
    }
  }
  return (sum[0] + sum[2]) + (sum[1] + sum[3]);
}

}  // namespace carillon
