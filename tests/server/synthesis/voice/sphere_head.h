// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "server/synthesis/voice/head.h"

namespace carillon {

/// A head as simple as can be, measured each 10 degrees: an ear on each side of a sphere. Each
/// response is one pulse, as late as sound takes around the sphere (Woodworth), and softer on the
/// far side.
class SphereHead {
 public:
  static constexpr double kRate = 48000, kRadius_m = 0.0875, kSoundSpeed = 343;
  static constexpr size_t kLength = 400;
  static constexpr double kPulse_frames = 1;  ///< standard deviation of the Gaussian pulse

  /// Delay of an ear against the middle of the head, seconds, for a sound whose direction has this
  /// sine towards the ear.
  static double DelayS(double sine) {
    const double angle = std::asin(std::clamp(sine, -1.0, 1.0));
    return -kRadius_m / kSoundSpeed * (sine > 0 ? sine : angle);
  }

  static double GainOf(double sine) { return 1 + 0.5 * sine; }

  static Head Make() {
    std::vector<std::vector<float>> responses;
    std::vector<MeasuredDirection> measured;
    constexpr double kStep = std::numbers::pi / 18;
    for (int row = -9; row <= 9; ++row) {
      for (int column = 0; column < 36; ++column) {
        const double level = std::cos(row * kStep);
        measured.push_back({.direction = {level * std::sin(column * kStep), std::sin(row * kStep),
                                          -level * std::cos(column * kStep)}});
      }
    }
    responses.reserve(2 * measured.size());
    for (MeasuredDirection& each : measured) {
      for (const size_t ear : {0U, 1U}) {
        const double sine = ear == 0 ? -each.direction[0] : each.direction[0];
        responses.push_back(Pulse(60 + DelayS(sine) * kRate, GainOf(sine)));
        each.responses[ear] = responses.back();
      }
    }
    return Head(measured, kRate);
  }

 private:
  /// A pulse at a fractional frame.
  static std::vector<float> Pulse(double frame, double gain) {
    std::vector<float> pulse(kLength);
    for (size_t n = 0; n < pulse.size(); ++n) {
      const double x = (static_cast<double>(n) - frame) / kPulse_frames;
      pulse[n] = static_cast<float>(gain * std::exp(-x * x / 2));
    }
    return pulse;
  }
};

}  // namespace carillon
