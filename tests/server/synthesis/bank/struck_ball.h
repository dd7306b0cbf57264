// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <vector>

#include "server/synthesis/bank/acceleration_noise.h"

namespace carillon {

inline constexpr double kBallRadiusM = 0.05, kBallDensity = 700;
inline constexpr double kBallM3 =
    4 * std::numbers::pi / 3 * kBallRadiusM * kBallRadiusM * kBallRadiusM;
inline constexpr double kBallAirDensity = 1.204, kBallSoundSpeed = 343;

/// A wooden ball that translates, with a vertex on each axis.
inline MovedBody MakeBall(double size = 1) {
  static constexpr auto kRadius = static_cast<float>(kBallRadiusM);
  static constexpr std::array<std::array<float, 3>, 3> kVertices = {
      std::array<float, 3>{kRadius, 0, 0}, {0, kRadius, 0}, {0, 0, kRadius}};
  MovedBody moved{
      .body = {}, .density_kg_per_m3 = kBallDensity, .size = size, .vertices = kVertices};
  moved.body.volume_m3 = kBallM3;
  const double moment = 0.4 * kBallM3 * kBallRadiusM * kBallRadiusM;
  moved.body.inertia_kg_m2 = {moment, moment, moment, 0, 0, 0};
  for (RigidRadiation::Motion& motion : moved.body.motions) motion.radius_m = kBallRadiusM;
  const double n_in_harmonics = std::sqrt(4 * std::numbers::pi / 3);
  moved.body.motions[0].strengths[3] = n_in_harmonics;
  moved.body.motions[1].strengths[1] = n_in_harmonics;
  moved.body.motions[2].strengths[2] = n_in_harmonics;
  return moved;
}

/// y'' = -2 b y' - 2 b^2 y + b f' in small steps, which is what the ball sounds like after the
/// force f(t) (the field equation of transfer.proto as a differential equation). With y' = v + b f.
template <class Force>
std::vector<double> IntegrateBall(double rate_hz, size_t frame_count, double amplitude,
                                  const Force& force) {
  constexpr int kSteps = 400;
  const double b = kBallSoundSpeed / kBallRadiusM, dt = 1 / (rate_hz * kSteps);
  std::vector<double> sound;
  double y = 0, v = 0;
  for (size_t n = 0; n < frame_count; ++n) {
    sound.push_back(amplitude * y);
    for (int i = 0; i < kSteps; ++i) {
      // The rule of the middle point.
      const double f = force((static_cast<double>(n) + (i + 0.5) / kSteps) / rate_hz);
      const double y_middle = y + dt / 2 * (v + b * f);
      const double v_middle = v + dt / 2 * (-2 * b * (v + b * f) - 2 * b * b * y);
      y += dt * (v_middle + b * f);
      v += dt * (-2 * b * (v_middle + b * f) - 2 * b * b * y_middle);
    }
  }
  return sound;
}

}  // namespace carillon
