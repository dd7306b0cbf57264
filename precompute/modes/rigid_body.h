// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <vector>

#include "precompute/fem/assembly.h"
#include "precompute/mesh/surface_mesh.h"

namespace carillon::precompute {

/// Returns the rigid-body modes in closed form. They are the M-orthonormalized combinations of
/// translations and infinitesimal rotations that do not move the fixed nodes. The result has a row
/// for each unknown and a column for each of these modes. The number of columns is six minus the
/// rank of the rigid motions of the fixed nodes: six for a free body, three if one point is fixed,
/// one if a line is fixed, otherwise none. The motions are independent because all elements have
/// volume. `nodes` are the positions of the moving nodes, and `fixed` those of the fixed nodes.
Eigen::MatrixXd RigidBodyModes(const std::vector<Point>& nodes, const SystemMatrices& system,
                               const std::vector<Point>& fixed = {});

/// Returns an upper bound of the lowest deformation eigenvalue by the Rayleigh-Ritz method. K and M
/// are projected on the rigid-body modes and on further displacements. Each of these is a
/// polynomial of second degree in the position, multiplied by the distance to the fixed nodes. The
/// bound is the first eigenvalue above those of the rigid-body modes.
double LowestEigenvalueBound(const std::vector<Point>& nodes, const SystemMatrices& system,
                             const std::vector<Point>& fixed = {});

}  // namespace carillon::precompute
