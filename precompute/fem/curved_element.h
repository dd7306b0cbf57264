// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstddef>

#include "absl/status/status.h"
#include "precompute/fem/elastic_constants.h"
#include "precompute/fem/element.h"
#include "precompute/mesh/tet_mesh.h"

namespace carillon::precompute {

/// The isoparametric tetrahedron: its ten shape functions map the reference tetrahedron to the
/// body, so that its edges and faces are curved. The reference coordinates of a
/// point are its barycentric coordinates for corners 1, 2 and 3.

/// The positions of an element's nodes (columns, metres), in the order of TetMesh.
using TenNodes = Eigen::Matrix<double, 3, 10>;

/// Returns the derivatives (rows) of the barycentric coordinates with respect to the reference
/// coordinates.
Eigen::Matrix<double, 4, 3> ReferenceGradients();

TenNodes NodesOf(const TetMesh& mesh, size_t element);

/// Returns the stiffness, N/m, by the quadrature rule of degree five (tet_rule.h). This rule is
/// exact if the element is straight.
QuadraticStiffness MakeCurvedStiffness(const TenNodes& nodes, const LameConstants& lame);

/// Returns the exact mass, kg, which is the same for each component. If `sharing` asks for a lumped
/// mass, the mass is lumped by diagonal scaling, as in MakeQuadraticMass.
QuadraticMass MakeCurvedMass(const TenNodes& nodes, double density_kg_per_m3, MassSharing sharing);

/// Returns the exact volume, m^3.
double CurvedVolumeM3(const TenNodes& nodes);

/// Checks that no curved element of the mesh is turned inside out, that is, that the determinant of
/// its Jacobian is positive at all quadrature points.
/// Errors: MESH_ELEMENT_INVERTED, stating the element's number.
absl::Status CheckCurvedElements(const TetMesh& mesh);

}  // namespace carillon::precompute
