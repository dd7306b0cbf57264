// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>

#include "precompute/eigen/eigensolver.h"
#include "precompute/fem/material.h"
#include "precompute/mesh/tet_mesh.h"

namespace carillon::precompute {

/// How far each mode's frequency is too high for the coarseness of the mesh, relatively: an
/// estimate.
///
/// What elements one order higher would add is tested, edge by edge and (quadratic elements) face
/// by face, with the hierarchical function b of that edge or face (Bank and Smith, A posteriori
/// error estimates based on hierarchical bases, SIAM J. Numer. Anal. 30, 1993):
///
///     r_b = a(b, phi) - Lambda m(b, phi),   delta Lambda ~ C sum_b r_b^T a(b, b)^-1 r_b
///
/// which sees the locking of thin walls, where averaged stresses do not. C is fitted to a bar, a
/// block, a plate and a tube so that it seldom says too little where the error is a few percent or
/// less; walls of linear elements that are off by half or more are off by more than it says. The
/// body is the polyhedron of its mesh: how well that follows a curved original is not in it.
///
/// `elastic` is that of the matrices the modes were solved from, for unit density; a consistent
/// mass is assumed. Shapes have all nodes; where the mesh is held nothing is added. Result: one
/// number a mode, 0.01 for one percent.
Eigen::VectorXd EstimateFrequencyErrors(const TetMesh& mesh, const ElasticConstants& elastic,
                                        const Modes& modes);

}  // namespace carillon::precompute
