// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>

#include "precompute/eigen/eigensolver.h"
#include "precompute/fem/elastic_constants.h"
#include "precompute/mesh/tet_mesh.h"

namespace carillon::precompute {

/// Returns the derivative d ln Lambda / d nu of each eigenvalue by Poisson's ratio, at fixed
/// Young's modulus. With K = lambda K_l + mu K_m it is
///
///     phi^T (lambda' K_l + mu' K_m) phi / Lambda,   for phi^T M phi = 1,
///     lambda' = E (1 + 2 nu^2) / ((1 + nu)^2 (1 - 2 nu)^2),   mu' = -E / (2 (1 + nu)^2)
///
/// The derivative is exact for the mesh. It must be used linearly in nu: phi^T K phi with the
/// constants of another nu keeps a change of volume that the true shape avoids, and is far too
/// high.
///
/// `elastic` has the constants from which the modes were computed. Shapes include all nodes.
Eigen::VectorXd PoissonSlopes(const TetMesh& mesh, const ElasticConstants& elastic,
                              const Modes& modes);

}  // namespace carillon::precompute
