// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

namespace carillon {

/// How the modes of a modal model radiate into air (proto/carillon/v1/transfer.proto). Immutable
/// once made, shared by all objects that sound with it.
struct Transfer {
  double speed_ratio = 0;  ///< sqrt(E / rho) of the material, over the speed of sound in air
  double sound_speed_m_per_s = 0;  ///< in air
  double air_density_kg_per_m3 = 0;
  /// #m: integral of each mode's squared far pattern over all directions, m^4/kg, for unit density
  /// and size. A mode that was not computed has the efficiency of the nearest one that was.
  std::vector<float> power_integrals;
};

}  // namespace carillon
