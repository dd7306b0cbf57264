// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "server/base/rigid_radiation.h"

namespace carillon {

/// How the modes of a modal model radiate into air (proto/carillon/v1/transfer.proto). A transfer
/// is immutable, and all objects that sound with it share it.
struct Transfer {
  double speed_ratio = 0;  ///< sqrt(E / rho) of the material, over the speed of sound in air
  double sound_speed_m_per_s = 0;  ///< speed of sound in air
  double air_density_kg_per_m3 = 0;
  /// #m: integral of each mode's squared far pattern over all directions, m^4/kg, for unit density
  /// and size. A mode that was not computed has the efficiency of the nearest computed mode.
  std::vector<float> power_integrals;
  std::array<double, 3> center_m{};  ///< origin of directions, in the body's frame
  double radius_m = 0;  ///< radius of the sphere about `center_m` that encloses the body
  /// #m + 1: mode i has the harmonics first[i] to first[i + 1] - 1, or none if the mode was not
  /// computed.
  std::vector<uint32_t> first;
  std::vector<uint32_t> harmonics;  ///< l^2 + l + m, ascending in each mode
  /// The coefficients (-i)^(l + 1) c_lm of the far pattern, scaled so that the sum of their squared
  /// magnitudes is one for each mode.
  std::vector<float> pattern_re{}, pattern_im{};
  /// Absent if a part of the body is fixed, or if the time did not suffice to compute it.
  std::optional<RigidRadiation> rigid = std::nullopt;
};

}  // namespace carillon
