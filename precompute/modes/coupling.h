// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>

#include "precompute/eigen/eigensolver.h"
#include "precompute/mesh/sounding_surface.h"
#include "precompute/mesh/tet_mesh.h"

namespace carillon::precompute {

/// Returns how strongly each mode moves air, which is c_m = omega_m * integral over the surface of
/// |n . phi_m| dA (O'Brien et al. 2002, 3.4; the signed integral would be zero for every bending
/// mode of a tube). The integral is exact for displacements that are linear on each triangle,
/// because a triangle is split where the sign changes. The result has one number for each mode, m^2
/// kg^(-1/2) s^(-1).
Eigen::VectorXd Couplings(const TetMesh& mesh, const SoundingSurface& surface, const Modes& modes);

/// Returns the integral of |f| over a triangle of this area, where f is linear and has these values
/// at the corners.
double IntegralOfAbsolute(double area, double f0, double f1, double f2);

}  // namespace carillon::precompute
