// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>

#include "client_sdk/examples/wind_chimes/gust.h"
#include "client_sdk/examples/wind_chimes/tubes.h"

namespace carillon::wind_chimes {

/// A point or a vector in the world, whose axis z points up: x, y, z, metres unless stated.
using Vector = std::array<double, 3>;

// The tubes hang on a circle, with their centres at one height. A thread holds each tube 22.4 % of
// its length from the end. The first bending mode has a node there, so that the thread damps it
// least.
inline constexpr double kCircleRadius_m = 0.062;
inline constexpr double kTubeCentre_z_m = -0.40;
inline constexpr double kNodeFromEnd = 0.224;

// The clapper is a wooden ball between the tubes. It hangs a little below their middles, so that it
// also excites modes that have a node there. Below the clapper hangs the sail that catches the
// wind.
inline constexpr double kClapperRadius_m = 0.030;
inline constexpr double kClapper_z_m = -0.44;
inline constexpr double kClapperMass_kg = 0.050;
inline constexpr double kSail_z_m = -0.75;
inline constexpr double kSailSide_m = 0.09;
inline constexpr double kSailMass_kg = 0.012;
inline constexpr double kThreadMass_kg = 0.002;
inline constexpr double kThreadRadius_m = 0.002;

// The restitution of a contact is the product of the restitutions of both bodies.
inline constexpr double kTubeRestitution = 0.9;
inline constexpr double kClapperRestitution = 0.65;
/// A contact that is slower does not bounce.
inline constexpr double kSlowest_m_per_s = 0.01;

/// The share of the velocity that air takes in a second.
inline constexpr double kLinearDamping = 0.02, kAngularDamping = 0.05;

/// Where the thread of a tube is tied.
inline Vector TopOf(size_t index) {
  const double angle = 2 * std::numbers::pi * static_cast<double>(index) / kTubes.size();
  return {kCircleRadius_m * std::cos(angle), kCircleRadius_m * std::sin(angle), 0};
}

inline double MassOf(const Tube& tube) {
  const double inner = kOuterRadius_m - kWall_m;
  return kDensity_kg_per_m3 * std::numbers::pi * (kOuterRadius_m * kOuterRadius_m - inner * inner) *
         tube.length_m;
}

/// The moments of inertia of a tube about x, y and z, kg m^2.
inline Vector InertiaOf(const Tube& tube) {
  const double inner = kOuterRadius_m - kWall_m;
  const double squares = kOuterRadius_m * kOuterRadius_m + inner * inner;
  const double mass = MassOf(tube);
  const double across = mass * (3 * squares + tube.length_m * tube.length_m) / 12;
  return {across, across, mass * squares / 2};
}

/// Returns the force of the wind on the sail, newtons: the drag F = rho/2 c A |v| v, where v is the
/// velocity of the wind relative to the sail.
inline Vector DragOnSail(const Gust::Velocity& wind, const Vector& sail_m_per_s) {
  constexpr double kAir_kg_per_m3 = 1.2, kPlate = 1.2;
  const Vector relative{wind.x_m_per_s - sail_m_per_s[0], wind.y_m_per_s - sail_m_per_s[1],
                        -sail_m_per_s[2]};
  const double speed = std::hypot(relative[0], relative[1], relative[2]);
  const double scale = kAir_kg_per_m3 / 2 * kPlate * kSailSide_m * kSailSide_m * speed;
  return {relative[0] * scale, relative[1] * scale, relative[2] * scale};
}

}  // namespace carillon::wind_chimes
