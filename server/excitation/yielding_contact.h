// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include "server/base/octave_gains.h"

namespace carillon {

/// The collision of a blow whose duration is not stated.
struct Collision {
  double reduced_mass_kg = 0;  ///< zero: the blow has a stated duration
  /// The approach speed, m/s, if the client stated it or poses tell it. It is otherwise J/(2 m).
  double stated_speed_m_per_s = 0;
};

/// A mode at the point and in the direction of a blow.
struct StruckMode {
  double damped_rad_per_s = 0;
  double decay_rate_per_s = 0;      ///< not above zero
  double shape_squared_per_kg = 0;  ///< (phi(x) . n)^2 for a unit vector n along the impulse
};

/// Returns the gains of a blow of a striker that the body's modes slow down and throw back.
///
/// Hertz's law takes the body for thick. A thin rim yields as a whole; Hertz's pulse would then
/// give its modes many times the energy of the striker. Here a striker of the reduced mass m meets
/// the modes through Hertz's spring,
///
///   m x'' = -F,  u_i'' + omega_i^2 u_i = phi_i^2 F,  F = k (x - sum u_i)^(3/2) where positive,
///   k = (3.218/T)^(5/2) m v^(-1/2)
///
/// with the speed v and the duration T of Hertz, integrated explicitly, with an exact rotation of
/// each mode in each step, until the two have parted for good. A gain is the root of the ratio
/// of an octave's energy to the energy that a raised cosine of duration T with the whole impulse
/// would give it. All octaves together have at most the energy m v^2/2 = J^2/(8 m).
///
/// The gains are all zero dB if the raised cosine would give the modes less than a thousandth of
/// the striker's energy: a thick body. The calculation takes 5 to 300 us if it is not, and 1 ms for
/// a sheet of 0.8 mm.
OctaveGains YieldingGains(std::span<const StruckMode> modes, const Collision& collision,
                          double impulse_newton_seconds, double duration_s);

}  // namespace carillon
