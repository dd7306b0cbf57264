// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "precompute/mesh/surface_mesh.h"
#include "precompute/mesh/tet_mesh.h"
#include "precompute/modes/deformation_modes.h"

namespace carillon::precompute {

/// What is kept of a decomposition, for unit Young's modulus and unit density.
struct ModalModel {
  int node_count = 0;
  int element_count = 0;
  double volume_m3 = 0;
  double complete_to_eigenvalue = 0;
  /// The lowest deformation mode of the body, held or (where it is the first beyond) not.
  double lowest_eigenvalue = 0;
  Verification verification;
  /// What the user should know though it stopped nothing.
  std::vector<std::string> warnings;

  std::vector<double> eigenvalues;  ///< #modes, ascending, 1/s^2
  std::vector<double> residuals;    ///< #modes, relative
  std::vector<double> couplings;    ///< #modes, see Couplings

  /// The sounding surface: boundary nodes of the mesh, metres, and its triangles.
  std::vector<std::array<float, 3>> vertices;
  std::vector<std::array<int32_t, 3>> triangles;
  /// For each of those triangles the given triangle it lies on.
  std::vector<int32_t> given_triangle;
  SurfaceMesh given;

  /// #vertices by 3 by #modes, row-major: mass-normalised shapes on the sounding surface,
  /// kg^(-1/2).
  std::vector<float> shapes;
};

/// `given`: the surface as given, to which the boundary of `mesh` refers.
ModalModel MakeModalModel(const TetMesh& mesh, const SurfaceMesh& given,
                          const DeformationModes& solution);

}  // namespace carillon::precompute
