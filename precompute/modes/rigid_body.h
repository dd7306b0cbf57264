// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <vector>

#include "precompute/fem/assembly.h"
#include "precompute/mesh/surface_mesh.h"

namespace carillon::precompute {

/// The six rigid-body modes in closed form: translations, then infinitesimal rotations about the
/// centroid of the nodes, made M-orthonormal. #U by 6. A body cannot be so degenerate that they are
/// dependent: its elements have volume.
Eigen::MatrixXd RigidBodyModes(const std::vector<Point>& nodes, const SystemMatrices& system);

/// An upper bound of a free body's lowest deformation eigenvalue: the seventh of K and M projected
/// on displacements that are polynomials of second degree in the position (Rayleigh and Ritz).
double LowestEigenvalueBound(const std::vector<Point>& nodes, const SystemMatrices& system);

}  // namespace carillon::precompute
