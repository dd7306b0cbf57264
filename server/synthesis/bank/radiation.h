// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

namespace carillon {

/// How the modes of a model radiate into air (proto/carillon/v1/transfer.proto). The arrays are the
/// caller's.
struct Radiation {
  /// #m: I, the integral of the squared far pattern over all directions, m^4/kg, for unit density
  /// and size. Empty: unknown; the modes sound by the paper's coupling.
  std::span<const float> power_integrals = {};
  double air_density_kg_per_m3 = 1.204;
  double sound_speed_m_per_s = 343;  ///< in air
};

/// The arrays of a modal model that decide how each of its modes sounds, all #m.
struct ModeTable {
  std::span<const double> eigenvalues;  ///< ascending, unit material
  std::span<const double> couplings;    ///< the paper's c_m, unit material
  Radiation radiation = {};
};

}  // namespace carillon
