// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/examples/wind_chimes/gust.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <span>

namespace carillon::wind_chimes {
namespace {

constexpr double kMeanSpeed_m_per_s = 3;
constexpr double kRise_s = 1.5;
constexpr double kFall_s = 3;
constexpr double kWander_rad = 2.5;

/// Returns a number from 0 to 1. The standard's engines give the same numbers with every library,
/// its distributions do not.
double Uniform(std::mt19937_64& engine) { return static_cast<double>(engine() >> 11) * 0x1p-53; }

template <class Waves>
double Sum(const Waves& waves, double time_s) {
  double sum = 0;
  for (const auto& wave : waves) {
    sum += std::sin(2 * std::numbers::pi * wave.frequency_hz * time_s + wave.phase_rad);
  }
  return sum / std::sqrt(static_cast<double>(waves.size()));
}

double Envelope(double time_s) {
  const double rise = std::clamp(time_s / kRise_s, 0.0, 1.0);
  const double fall = std::clamp((time_s - Gust::kCalmAfter_s) / kFall_s, 0.0, 1.0);
  return rise * (1 - fall);
}

}  // namespace

Gust::Gust(uint64_t seed) {
  std::mt19937_64 engine(seed);
  for (auto* waves : {&strength_, &direction_}) {
    double frequency = waves == &strength_ ? 0.15 : 0.05;
    for (Wave& wave : *waves) {
      wave = {frequency * (0.8 + 0.4 * Uniform(engine)), 2 * std::numbers::pi * Uniform(engine)};
      frequency *= 1.6;
    }
  }
}

Gust::Velocity Gust::At(double time_s) const {
  const double speed =
      kMeanSpeed_m_per_s * Envelope(time_s) * std::max(0.0, 1 + 0.6 * Sum(strength_, time_s));
  const double angle = kWander_rad * Sum(direction_, time_s);
  return {speed * std::cos(angle), speed * std::sin(angle)};
}

}  // namespace carillon::wind_chimes
