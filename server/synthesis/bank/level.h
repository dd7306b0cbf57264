// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <numbers>

namespace carillon {

/// Density of air at 20 C, kg/m^3.
inline constexpr double kAirDensityKgPerM3 = 1.204;

/// From the sum of c_m z_m, a volume velocity Q in m^3/s, to pascals at 1 m. A small source
/// radiates p = rho_air omega Q / (4 pi r) into the open; the paper's sum has no omega of its own,
/// so it is taken at 1 kHz for all modes alike.
inline constexpr double kPascalsPerVolumeVelocity =
    kAirDensityKgPerM3 * (2 * std::numbers::pi * 1000) / (4 * std::numbers::pi * 1.0);

/// Pressure at 1 m that is full scale: 20 Pa peak, 120 dB above 20 uPa. An aluminum chime of 0.5 m
/// struck in its middle with 0.02 N s then comes out at -14 dB of it with a contact of 1 ms, at -11
/// dB with one of 0.5 ms.
inline constexpr double kFullScalePa = 20;

/// From the sum of c_m z_m to samples. One constant for all objects: a struck anvil is louder than
/// a struck pin.
inline constexpr double kSamplesPerVolumeVelocity = kPascalsPerVolumeVelocity / kFullScalePa;

}  // namespace carillon
