// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "precompute/mesh/surface_mesh.h"

namespace carillon::precompute {

/// The mass properties of a body of unit density.
struct MassProperties {
  double volume_m3 = 0;
  Point center_of_mass{};
  /// The components xx, yy, zz, xy, yz, zx of the inertia tensor about the centre of mass, kg m^2.
  /// The products of inertia are negative integrals.
  std::array<double, 6> inertia{};
};

/// Returns the mass properties of a body with these moments about the origin: the mass, which
/// stands for the volume, the first moments x, y, z, and the second moments xx, yy, zz, xy, yz, zx.
MassProperties FromMoments(std::span<const double, 10> moments);

/// Computes the mass properties by the divergence theorem from a closed surface, including the
/// walls of voids.
MassProperties ComputeMassProperties(std::span<const std::array<float, 3>> vertices,
                                     std::span<const std::array<int32_t, 3>> triangles);

}  // namespace carillon::precompute
