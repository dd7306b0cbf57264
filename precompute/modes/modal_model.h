// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "precompute/mesh/surface_mesh.h"
#include "precompute/mesh/tet_mesh.h"
#include "precompute/modes/deformation_modes.h"
#include "precompute/modes/solver_comparison.h"

namespace carillon::precompute {

/// The result of a decomposition, for unit Young's modulus and unit density.
struct ModalModel {
  int node_count = 0;
  int element_count = 0;
  double volume_m3 = 0;
  double complete_to_eigenvalue = 0;
  /// Modes below the limit that was asked for, where it was lowered; zero: it was not.
  int lowered_from_mode_count = 0;
  /// The lowest deformation eigenvalue of the body, also if it lies above the limit and is not in
  /// the model.
  double lowest_eigenvalue = 0;
  Verification verification;
  /// Set where another solver was asked for its opinion.
  std::optional<SolverComparison> comparison;
  int left_out_mode_count = 0;  ///< found, but not kept: see KeepMostAudible
  /// Warnings for the user.
  std::vector<std::string> warnings;

  std::vector<double> eigenvalues;  ///< #modes, ascending, 1/s^2
  std::vector<double> residuals;    ///< #modes, relative
  std::vector<double> couplings;    ///< #modes, see Couplings
  /// #modes, see EstimateFrequencyErrors.
  std::vector<double> estimated_errors;

  /// The sounding surface: boundary nodes of the mesh, metres, and its triangles.
  std::vector<std::array<float, 3>> vertices;
  std::vector<std::array<int32_t, 3>> triangles;
  /// For each of those triangles the given triangle it lies on.
  std::vector<int32_t> given_triangle;
  SurfaceMesh given;

  /// #vertices by 3 by #modes, row-major: mass-normalised shapes on the sounding surface,
  /// kg^(-1/2).
  std::vector<float> shapes;

  /// The greatest of the estimated errors; zero without modes.
  double WorstError() const {
    return estimated_errors.empty() ? 0 : *std::ranges::max_element(estimated_errors);
  }
};

/// `given` is the surface from which `mesh` was made: each boundary triangle of `mesh` names the
/// triangle of `given` on which it lies (tet_mesh.h). `elastic` are the constants of the matrices.
ModalModel MakeModalModel(const TetMesh& mesh, const SurfaceMesh& given,
                          const ElasticConstants& elastic, const DeformationModes& solution);

}  // namespace carillon::precompute
