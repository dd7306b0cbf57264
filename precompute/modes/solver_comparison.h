// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <string>

#include "precompute/mesh/tet_mesh.h"
#include "precompute/modes/deformation_modes.h"

namespace carillon::precompute {

/// How far two solutions of one system are apart.
struct SolverComparison {
  std::string solver;   ///< the name of the second solver
  std::string failure;  ///< why it found nothing; empty: it found the modes
  int mode_count = 0;   ///< of the first solver
  int other_mode_count = 0;
  double largest_frequency_difference = 0;  ///< |f - f'| / f, over the modes that both have
  /// The least modal assurance criterion, 1 where the shapes are the same. Modes whose eigenvalues
  /// lie closer than kSameEigenvalue are compared as one subspace, since any basis of it is right:
  /// the criterion is then the squared cosine of the largest angle between the two subspaces.
  double least_mac = 1;

  /// One line for people.
  std::string Text() const;
};

/// Neighbours whose eigenvalues differ by less, relatively, belong to one subspace.
inline constexpr double kSameEigenvalue = 1e-3;

/// Compares the modes of `first` and `second`, which are solutions of the body whose matrices
/// Assemble made.
SolverComparison CompareSolutions(const SystemMatrices& system, const TetMesh& mesh,
                                  const Modes& first, const Modes& second);

}  // namespace carillon::precompute
