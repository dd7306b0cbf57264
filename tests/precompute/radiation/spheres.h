// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <vector>

#include "precompute/mesh/surface_mesh.h"
#include "precompute/radiation/boundary_operator.h"

namespace carillon::precompute {

/// An icosahedron whose triangles are cut in four `halvings` times, about the origin, with the
/// volume of a sphere of this radius: 10 * 4^halvings + 2 vertices.
SurfaceMesh MakeIcosphere(double radius_m, int halvings);

/// The harmonics of SphereGrid up to `order` in a direction of any length but zero.
std::vector<double> RealHarmonics(int order, const Point& direction);

/// The power integral that a sphere of this radius radiates where it moves along its normals by
/// Y_lm: p = h_l(k r)/(k h_l'(k a)) Y_lm, so that I = 1/(k^4 |h_l'(k a)|^2).
double ExactPowerIntegral(int l, double wavenumber, double radius_m);

/// Displacement Y_lm along the normals of the sphere at each vertex.
Displacement HarmonicMotion(const SurfaceMesh& sphere, int l, int m);

}  // namespace carillon::precompute
