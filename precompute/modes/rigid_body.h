// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <vector>

#include "precompute/fem/assembly.h"
#include "precompute/mesh/surface_mesh.h"

namespace carillon::precompute {

/// The rigid-body modes in closed form: the combinations of translations and infinitesimal
/// rotations about the centroid of the nodes that do not move the fixed nodes, M-orthonormalized.
/// The result is #U by their number, which is six less the rank of the rigid motions of the fixed
/// nodes: six for a free body, three if one point is fixed, one if a line is fixed, otherwise none.
/// The motions are independent because all elements have volume. `nodes`: positions of the moving
/// nodes; `held`: positions of the fixed nodes.
Eigen::MatrixXd RigidBodyModes(const std::vector<Point>& nodes, const SystemMatrices& system,
                               const std::vector<Point>& held = {});

/// An upper bound of the lowest deformation eigenvalue by Rayleigh and Ritz: K and M are projected
/// on the rigid-body modes and on displacements that are polynomials of second degree in the
/// position times the distance to the fixed nodes. The bound is the first eigenvalue above those of
/// the rigid-body modes.
double LowestEigenvalueBound(const std::vector<Point>& nodes, const SystemMatrices& system,
                             const std::vector<Point>& held = {});

}  // namespace carillon::precompute
