// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <numbers>
#include <random>
#include <utility>
#include <vector>

#include "client_sdk/fit/matching.h"
#include "client_sdk/fit/recording.h"

namespace carillon::fit {

/// A mode as it is put into a sound.
struct TrueMode {
  double frequency_hz;
  double decay_per_s;
  double amplitude;
};

inline constexpr double kSampleRate_hz = 48000;

/// A blow 0.3 s after the beginning, with white noise of this standard deviation.
inline Recording Struck(const std::vector<TrueMode>& modes, double noise, double seconds = 1.5) {
  std::mt19937 random(3);
  std::normal_distribution<double> normal(0, noise);
  const auto onset = static_cast<size_t>(0.3 * kSampleRate_hz);
  std::vector<float> samples(onset + static_cast<size_t>(seconds * kSampleRate_hz));
  for (size_t n = 0; n < samples.size(); ++n) {
    double value = normal(random);
    const double t = (static_cast<double>(n) - static_cast<double>(onset)) / kSampleRate_hz;
    for (const TrueMode& mode : modes) {
      if (t >= 0) {
        value += mode.amplitude * std::exp(-mode.decay_per_s * t) *
                 std::sin(2 * std::numbers::pi * mode.frequency_hz * t);
      }
    }
    samples[n] = static_cast<float>(value);
  }
  return {.name = "struck", .sample_rate_hz = kSampleRate_hz, .channels = {std::move(samples)}};
}

/// The sound in a room whose tail has this energy relative to the direct sound.
inline Recording InRoom(const Recording& dry, double decay_per_s, double share) {
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  std::vector<double> tail(static_cast<size_t>(7 / decay_per_s * kSampleRate_hz));
  double energy = 0;
  for (size_t n = 0; n < tail.size(); ++n) {
    tail[n] = normal(random) * std::exp(-decay_per_s * static_cast<double>(n) / kSampleRate_hz);
    energy += tail[n] * tail[n];
  }
  Recording wet = dry;
  const std::vector<float>& from = dry.channels[0];
  std::vector<float>& to = wet.channels[0];
  for (size_t n = 0; n < to.size(); ++n) {
    double sum = 0;
    for (size_t k = 0; k <= n && k < tail.size(); ++k) sum += tail[k] * double{from[n - k]};
    to[n] += static_cast<float>(std::sqrt(share / energy) * sum);
  }
  return wet;
}

/// Lines without a pattern, half of which grow with Poisson's ratio and half of which fall.
inline ModelLines IrregularLines(size_t count) {
  ModelLines lines{.poisson_ratio = 0.28};
  std::mt19937 random(7);
  std::uniform_real_distribution<double> step(1.02, 1.3);
  double hz = 0.2;  // for each m/s
  for (size_t j = 0; j < count; ++j) {
    hz *= step(random);
    const double omega = 2 * std::numbers::pi * hz;
    lines.eigenvalues.push_back(omega * omega);
    lines.slopes.push_back(j % 2 == 0 ? 0.5 : -0.75);
  }
  lines.errors.assign(count, 0);
  lines.complete_to_eigenvalue = 1.1 * lines.eigenvalues.back();
  return lines;
}

}  // namespace carillon::fit
