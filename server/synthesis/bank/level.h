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

/// The reference level: the pressure that corresponds to full scale unless a setting says
/// otherwise. It is 200 Pa peak, 140 dB above 20 uPa, so that a steel box of 23.6 kg that falls
/// from 1 m on a corner stays below full scale at half a metre. An aluminum chime of 0.5 m struck
/// in its middle with 0.02 N s peaks at -34 dB of full scale with a contact of 1 ms, and at -31 dB
/// with one of 0.5 ms.
inline constexpr double kFullScalePa = 200;

/// Bounds of the pressure that a setting may give to full scale: 0 to 180 dB above 20 uPa.
inline constexpr double kLeastFullScalePa = 0.00002;
inline constexpr double kMostFullScalePa = 20000;

/// Converts the sum of c_m z_m to samples at the reference level. All objects share this constant,
/// so a struck anvil is louder than a struck pin.
inline constexpr double kSamplesPerVolumeVelocity = kPascalsPerVolumeVelocity / kFullScalePa;

/// The largest amplitude that a mode or a body's acceleration noise may have: 24 dB above full
/// scale, 164 dB above 20 uPa at 1 m. An object that is struck far too hard, or whose model is
/// wrong, must not make the limiter suppress all other objects until it has decayed.
inline constexpr double kMostAmplitude = 16;

}  // namespace carillon
