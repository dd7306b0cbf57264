// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

namespace carillon {

/// How a free body of unit density radiates when it accelerates as a whole
/// (proto/carillon/v1/transfer.proto, RigidBody).
struct RigidRadiation {
  /// One of the six rigid motions. The body radiates like a sphere of this radius whose normal
  /// velocity is a sum of spherical harmonics with these strengths.
  struct Motion {
    double radius_m = 0;                ///< zero if the motion moves no air
    std::array<double, 9> strengths{};  ///< s_lm at index l^2 + l + m; in metres for rotations
  };
  double volume_m3 = 0;
  std::array<double, 3> center_of_mass_m{};
  std::array<double, 6> inertia_kg_m2{};  ///< about the centre of mass: xx, yy, zz, xy, yz, zx
  std::array<Motion, 6> motions{};        ///< translation along x, y, z, rotation about x, y, z
};

}  // namespace carillon
