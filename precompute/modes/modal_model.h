// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "precompute/fem/body_materials.h"
#include "precompute/mesh/surface_mesh.h"
#include "precompute/mesh/tet_mesh.h"
#include "precompute/modes/deformation_modes.h"
#include "precompute/modes/spectra_check.h"

namespace carillon::precompute {

/// A region of a body of several materials, and its parts of the energies of each mode.
struct ModelRegion {
  RegionMaterial material;            ///< relative to the reference of the model
  std::vector<double> strain_parts;   ///< #modes, from 0 to 1
  std::vector<double> kinetic_parts;  ///< #modes, from 0 to 1
};

/// The result of a decomposition, for unit Young's modulus and unit density.
struct ModalModel {
  int node_count = 0;
  int element_count = 0;
  double volume_m3 = 0;
  double complete_to_eigenvalue = 0;
  /// If the limit was lowered, the number of modes below the requested limit; otherwise zero.
  int lowered_from_mode_count = 0;
  /// The lowest deformation eigenvalue of the body, even if it lies above the limit and is not in
  /// the model.
  double lowest_eigenvalue = 0;
  /// The estimated error of the frequency of that lowest mode, if the model has no mode. It is not
  /// stored.
  double lowest_error = 0;
  Verification verification;
  /// The comparison with Spectra, if it was requested.
  std::optional<SpectraCheck> check;
  int left_out_mode_count = 0;  ///< modes that were found but not kept, see KeepMostAudible
  /// Warnings for the user.
  std::vector<std::string> warnings;

  std::vector<double> eigenvalues;  ///< #modes, ascending, 1/s^2
  std::vector<double> residuals;    ///< #modes, relative
  std::vector<double> couplings;    ///< #modes, see Couplings
  /// #modes, see EstimateFrequencyErrors.
  std::vector<double> estimated_errors;
  std::vector<double> poisson_slopes;  ///< #modes, see PoissonSlopes
  /// #nodes of the mesh, see ErrorEstimate::at_node. Not stored.
  std::vector<double> error_at_node;

  /// The vertices (boundary nodes of the mesh, metres) and triangles of the sounding surface.
  std::vector<std::array<float, 3>> vertices;
  std::vector<std::array<int32_t, 3>> triangles;
  /// For each of `triangles`, the given triangle on which it lies.
  std::vector<int32_t> given_triangle;
  SurfaceMesh given;
  /// The regions of a body of several materials; empty if it has one.
  std::vector<ModelRegion> regions = {};
  /// For each given triangle, the region that it bounds; empty if there are no regions.
  std::vector<uint8_t> given_triangle_regions = {};
  /// The mass, its first and its second moments, see MassMoments; empty if there are no regions.
  std::vector<double> mass_moments = {};

  /// #vertices by 3 by #modes, row-major: mass-normalised shapes on the sounding surface,
  /// kg^(-1/2).
  std::vector<float> shapes;

  /// Returns the greatest estimated error, or zero if there are no modes.
  double WorstError() const {
    return estimated_errors.empty() ? 0 : *std::ranges::max_element(estimated_errors);
  }
};

/// Makes a model from a solution. `given` is the surface to which the given triangles of the
/// boundary of `mesh` refer (tet_mesh.h). `materials` are those of the matrices.
ModalModel MakeModalModel(const TetMesh& mesh, const SurfaceMesh& given,
                          const BodyMaterials& materials, const DeformationModes& solution);

}  // namespace carillon::precompute
