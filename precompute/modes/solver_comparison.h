// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <string>

#include "precompute/mesh/tet_mesh.h"
#include "precompute/modes/deformation_modes.h"

namespace carillon::precompute {

/// The difference between two solutions of one system.
struct SolverComparison {
  std::string solver;   ///< the name of the second solver
  std::string failure;  ///< why the second solver failed; empty if it did not
  int mode_count = 0;   ///< number of modes of the first solver
  int other_mode_count = 0;
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

/// Compares the modes of `first` and `second`, which are solutions of the body whose matrices
/// Assemble made.
SolverComparison CompareSolutions(const SystemMatrices& system, const TetMesh& mesh,
                                  const Modes& first, const Modes& second);

}  // namespace carillon::precompute
