// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <numbers>
#include <random>

#include "server/synthesis/bank/sounding_modes.h"

namespace carillon {

/// Modes as a large scene has them: frequencies log-uniform from 20 Hz to 20 kHz, T60 log-uniform
/// from 20 ms to 60 s. Every bank of the same seed is the same, everywhere.
inline SoundingModes DrawModes(uint32_t mode_count, uint64_t seed) {
  std::mt19937_64 random(seed);
  // Not std::uniform_real_distribution, which libraries implement differently.
  const auto draw = [&random] { return static_cast<double>(random() >> 11) * 0x1p-53; };
  SoundingModes sounding;
  for (uint32_t column = 0; column < mode_count; ++column) {
    const double frequency_hz = 20 * std::pow(1000.0, draw());
    const double t60_s = 0.02 * std::pow(3000.0, draw());
    sounding.modes.push_back({.column = column,
                              .natural_frequency_hz = frequency_hz,
                              .damped_rad_per_s = 2 * std::numbers::pi * frequency_hz,
                              .decay_rate_per_s = -std::log(1000.0) / t60_s,
                              .coupling = 0.5 + draw()});
  }
  return sounding;
}

}  // namespace carillon
