// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/SparseCore>

#include "precompute/fem/body_materials.h"
#include "precompute/fem/element.h"
#include "precompute/mesh/tet_mesh.h"

namespace carillon::precompute {

/// The stiffness and mass matrices of a body. Unknown 3 i + a is component a (x, y or z) of the
/// displacement of the i-th node that is not fixed. #U is the number of unknowns, unknown_count().
struct SystemMatrices {
  using Sparse = Eigen::SparseMatrix<double>;

  /// #U by #U, N/m, symmetric: the lower triangle only.
  Sparse K;
  /// #U by #U, kg, symmetric positive definite: the lower triangle only. M does not couple the x, y
  /// and z components of the displacement with each other.
  Sparse M;

  Eigen::Index unknown_count() const { return K.rows(); }
};

/// Assembles the matrices of a body from elements of 4 or 10 nodes. Elements with curved edges are
/// isoparametric. Fixed nodes have no unknowns. Every element must have positive volume, and pass
/// CheckCurvedElements.
SystemMatrices Assemble(const TetMesh& mesh, const BodyMaterials& materials, MassSharing sharing);

/// Assembles the matrices of a body of one material.
inline SystemMatrices Assemble(const TetMesh& mesh, const ElasticConstants& elastic,
                               double density_kg_per_m3, MassSharing sharing) {
  return Assemble(mesh, BodyMaterials(elastic, density_kg_per_m3), sharing);
}

/// Returns the geometry of an element, as if its edges were straight.
TetGeometry GeometryOf(const TetMesh& mesh, size_t element);

/// Returns the volume of the mesh, m^3.
double VolumeM3(const TetMesh& mesh);

}  // namespace carillon::precompute
