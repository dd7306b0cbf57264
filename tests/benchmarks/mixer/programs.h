// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <time.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "server/synthesis/bank/sounding_modes.h"

namespace carillon {

/// CPU seconds of this thread.
inline double ThreadSeconds() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

/// The value below which so large a share of the values lies.
inline double Quantile(std::vector<double> values, double share) {
  const auto index = static_cast<size_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + static_cast<ptrdiff_t>(index), values.end());
  return values[index];
}

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

using Arguments = std::vector<std::string>;

/// Each prints one JSON object a line and returns the program's exit status.
/// SECONDS of sound a measurement.
int MeasureRinging(const Arguments& arguments);
/// SECONDS of sound a measurement.
int MeasureStruck(const Arguments& arguments);
/// SECONDS of sound a measurement.
int MeasureDirected(const Arguments& arguments);
/// SECONDS of each rate.
int MeasureFlood(const Arguments& arguments);
/// Prints the modes of a bank, one "frequency_hz t60_s amplitude" a line, for other programs.
int PrintPopulation(const Arguments& arguments);

}  // namespace carillon
