// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "precompute/eigen/eigensolver.h"
#include "precompute/mesh/tet_mesh.h"
#include "precompute/modes/deformation_modes.h"

namespace carillon::precompute {

/// The difference between a model's modes and those that the library Spectra finds.
struct SpectraCheck {
  std::string failure{};                    ///< why Spectra found no modes; empty if it did
  int mode_count = 0;                       ///< of the model
  int spectra_mode_count = 0;               ///< below the limit up to which the model is complete
  double largest_frequency_difference = 0;  ///< |f - f'| / f, over the modes that both found
  /// The least modal assurance criterion, which is 1 if the shapes are the same. Modes whose
  /// eigenvalues lie closer than kSameEigenvalue are compared as one subspace, because any basis of
  /// it is right. The criterion is then the squared cosine of the largest angle between the two
  /// subspaces.
  double least_mac = 1;

  /// Returns a description in one line for people.
  std::string Text() const;
};

/// Neighbouring modes belong to one subspace if their eigenvalues differ by less than this
/// fraction.
inline constexpr double kSameEigenvalue = 1e-3;

/// Finds the lowest modes by Spectra with CHOLMOD's factorization, which share neither the
/// iteration nor the factorization with block Lanczos: implicitly restarted Lanczos on (K - shift
/// M)^-1 M with a small negative shift, for which K - shift M is positive definite although K has
/// null vectors. Errors: VERIFICATION_FAILED (did not converge), OUT_OF_MEMORY, INVALID_SETTINGS
/// (not more unknowns than modes).
absl::StatusOr<Modes> SolveWithSpectra(const SystemMatrices& system, const ModeRequest& request);

/// Compares the modes of a body, whose shapes include fixed nodes, with those of `spectra`, whose
/// shapes have one row for each unknown.
SpectraCheck CompareModes(const SystemMatrices& system, const TetMesh& mesh, const Modes& modes,
                          const Modes& spectra);

/// Compares the solution of a body, whose matrices Assemble made, with Spectra's.
SpectraCheck CheckWithSpectra(const SystemMatrices& system, const TetMesh& mesh,
                              const DeformationModes& solution);

}  // namespace carillon::precompute
