// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <numbers>

namespace carillon {

/// Density of air at 20 C, kg/m^3.
inline constexpr double kAirDensityKgPerM3 = 1.204;

/// Converts the sum of c_m z_m, a volume velocity Q in m^3/s, to pascals at 1 m. A small source in
/// the open radiates p = rho_air omega Q / (4 pi r). The paper's sum does not contain omega, so
/// omega is taken at 1 kHz for all modes.
inline constexpr double kPascalsPerVolumeVelocity =
    kAirDensityKgPerM3 * (2 * std::numbers::pi * 1000) / (4 * std::numbers::pi * 1.0);

/// The pressure at 1 m that corresponds to full scale: 20 Pa peak, 120 dB above 20 uPa. An aluminum
/// chime of 0.5 m struck in its middle with 0.02 N s peaks at -14 dB of full scale with a contact
/// of 1 ms, and at -11 dB with a contact of 0.5 ms.
inline constexpr double kFullScalePa = 20;

/// Converts the sum of c_m z_m to samples. All objects share this constant, so a struck anvil is
/// louder than a struck pin.
inline constexpr double kSamplesPerVolumeVelocity = kPascalsPerVolumeVelocity / kFullScalePa;

/// The largest amplitude that a mode or a body's acceleration noise may have: 24 dB above full
/// scale, 144 dB SPL at the reference distance. One object that is struck beyond all measure, or
/// whose model is wrong, must not drive the limiter so far that the others are not heard until it
/// has decayed.
inline constexpr double kMostAmplitude = 16;

}  // namespace carillon
