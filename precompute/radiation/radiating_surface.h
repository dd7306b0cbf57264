// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "precompute/mesh/surface_mesh.h"
#include "precompute/sparse/workers.h"

namespace carillon::precompute {

/// The modes of a body on its surface, in the layout of a modal model. The spans refer to arrays of
/// the caller, which must outlive the struct.
struct SurfaceModes {
  std::span<const std::array<float, 3>> vertices;  ///< metres
  std::span<const std::array<int32_t, 3>> triangles;
  std::span<const double> eigenvalues;  ///< 1/s^2
  std::span<const float> shapes;        ///< #vertices by 3 by #modes, row-major
  /// The moments of FromMoments (mass_properties.h); empty for a body of unit density.
  std::span<const double> mass_moments = {};
  size_t mode_count() const { return eigenvalues.size(); }
};

/// The motion of the surface in one mode, along the normals.
struct NormalMotion {
  double energy = 0;        ///< integral of (n . phi)^2, m^2/kg
  double wavelength_m = 0;  ///< 2 pi sqrt(2 integral f^2 / integral |grad f|^2), f = n . phi
};

/// The part of a body's surface that touches the surrounding air, without the walls of enclosed
/// voids and the surfaces inside such voids.
struct RadiatingSurface {
  SurfaceMesh mesh;
  std::vector<int32_t> body_vertex;  ///< for each vertex, its index in SurfaceModes
  Point center{};                    ///< centre of the box around the surface
  double radius_m = 0;  ///< radius of the sphere around `center` that contains the surface
};

RadiatingSurface FindRadiatingSurface(const SurfaceModes& modes);

/// Returns the motion of each mode along the surface's normals.
std::vector<NormalMotion> NormalMotions(const SurfaceModes& modes, const RadiatingSurface& surface,
                                        Workers& workers);

}  // namespace carillon::precompute
