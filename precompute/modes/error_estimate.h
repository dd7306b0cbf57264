// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <vector>

#include "precompute/eigen/eigensolver.h"
#include "precompute/fem/body_materials.h"
#include "precompute/mesh/tet_mesh.h"

namespace carillon::precompute {

/// Errors of frequencies, and the nodes near which they arise.
struct ErrorEstimate {
  /// One relative error for each mode, 0.01 for one percent.
  Eigen::VectorXd errors;
  /// For each node of the mesh, the share of the error that arises near it: the parts of the
  /// relative corrections delta Lambda / Lambda of all edges and faces b at the node, each divided
  /// among the corners of b, and summed over the modes. Each mode has the square of its error as a
  /// weight, because the worst modes decide how fine a mesh must be. The unit is arbitrary;
  /// mid-side nodes have zero.
  std::vector<double> at_node;
};

/// Estimates the relative error of each mode's frequency that the mesh causes. The computed
/// frequency is too high.
///
/// The residual of each mode is tested with the functions that elements one order higher would add.
/// These are the hierarchical functions b of each edge and (quadratic elements) of each face (Bank
/// and Smith, A posteriori error estimates based on hierarchical bases, SIAM J. Numer. Anal. 30,
/// 1993):
///
///     r_b = a(b, phi) - Lambda m(b, phi),   delta Lambda ~ C sum_b w_b r_b^T a(b, b)^-1 r_b
///
/// At a re-entrant edge of the body the stress is singular, and functions of a higher order take up
/// a smaller part of the error than elsewhere. The weight w_b compensates for this. Each corner of
/// b has a weight by PlaceWeights(), which also compensates for the locking of flat walls, and w_b
/// is the largest of these weights.
///
/// The estimate detects the locking of thin walls, which estimates by averaged stresses do not. C
/// is fitted to a bar, a block, a plate and a tube so that the estimate is rarely too small for
/// errors of a few percent or less. The estimate is too small for walls of linear elements whose
/// errors are a half or more. The estimate refers to the body as meshed, including curved elements.
/// It does not include the difference between the mesh and the shape of the original object.
///
/// `materials` are those of the matrices from which the modes were computed. A consistent mass is
/// assumed. Shapes include all nodes; fixed edges and faces add
/// nothing.
ErrorEstimate EstimateFrequencyErrors(const TetMesh& mesh, const BodyMaterials& materials,
                                      const Modes& modes);

}  // namespace carillon::precompute
