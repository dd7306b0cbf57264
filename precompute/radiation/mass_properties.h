// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "precompute/mesh/surface_mesh.h"

namespace carillon::precompute {

/// The mass of a body of unit density.
struct MassProperties {
  double volume_m3 = 0;
  Point center_of_mass{};
  /// About the centre of mass: xx, yy, zz, xy, yz, zx of the tensor, whose products of inertia are
  /// negative integrals; kg m^2.
  std::array<double, 6> inertia{};
};

/// Integrates by the divergence theorem over a closed surface, walls of voids included.
MassProperties ComputeMassProperties(std::span<const std::array<float, 3>> vertices,
                                     std::span<const std::array<int32_t, 3>> triangles);

}  // namespace carillon::precompute
