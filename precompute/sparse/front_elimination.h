// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <vector>

#include "precompute/sparse/workers.h"

namespace carillon::precompute {

/// The dense matrix of one supernode: its pivot columns (height by pivots) and the update matrix
/// for its parent (updates by updates), both column-major, lower.
template <typename Real>
struct Front {
  int pivots = 0;
  int updates = 0;
  std::vector<Real> panel;
  Real* update = nullptr;

  int height() const { return pivots + updates; }
};

enum class Elimination {
  kDone,
  kNotPositive,  ///< a negative pivot where none was allowed
  kVanishing,    ///< a pivot whose sign is rounding
};

/// Turns the panel into L, and subtracts its part from the update matrix: A = L S L^T with signs S
/// on the diagonal. This is a Cholesky factorization except for the few columns with negative
/// pivots. `negative`: if null, negative pivots are not allowed; otherwise their number is added to
/// it. Pivots up to `smallest` count as vanishing.
template <typename Real>
Elimination Eliminate(Front<Real>& front, Real smallest, Workers& workers, int* negative);

}  // namespace carillon::precompute
