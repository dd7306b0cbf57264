// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <vector>

#include "precompute/fem/assembly.h"
#include "precompute/mesh/surface_mesh.h"

namespace carillon::precompute {

/// The rigid-body modes in closed form: the motions, combined of translations and infinitesimal
/// rotations about the centroid of the nodes, that leave the places held where they are, made
/// M-orthonormal. #U by their number, which is six less the rank of the motions of the places held:
/// six for a free body, three for one held at a point, one on a line, else none. A body cannot be
/// so degenerate that they are dependent: its elements have volume. `nodes`: those that move,
/// `held`: those that do not.
Eigen::MatrixXd RigidBodyModes(const std::vector<Point>& nodes, const SystemMatrices& system,
                               const std::vector<Point>& held = {});

/// An upper bound of the lowest deformation eigenvalue: of K and M projected on the rigid-body
/// modes and on displacements that are polynomials of second degree in the position times the
/// distance to what is held (Rayleigh and Ritz), the first above those of the rigid-body modes.
double LowestEigenvalueBound(const std::vector<Point>& nodes, const SystemMatrices& system,
                             const std::vector<Point>& held = {});

}  // namespace carillon::precompute
