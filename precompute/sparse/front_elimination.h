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

/// Turns the panel into L, and what it leaves of the update matrix, by A = L S L^T with signs S on
/// the diagonal: a Cholesky factorization but for the columns of negative pivots, which are few.
/// `negative`: where it is null, none is allowed; else their number is added to it. Pivots up to
/// `smallest` vanish.
template <typename Real>
Elimination Eliminate(Front<Real>& front, Real smallest, Workers& workers, int* negative);

}  // namespace carillon::precompute
