// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <vector>

#include "precompute/sparse/workers.h"

namespace carillon::precompute {

/// The dense matrix of one supernode. It consists of the pivot columns (height by pivots) and of
/// the update matrix for the parent (updates by updates), both column-major and lower.
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
  kNotPositive,  ///< a pivot was negative although none was allowed
  kVanishing,    ///< a pivot is so small that rounding determines its sign
};

/// Overwrites the panel by L, and subtracts the panel's contribution from the update matrix: A = L
/// S L^T with signs S on the diagonal. This is a Cholesky factorization except for the few columns
/// with negative pivots. If `negative` is null, negative pivots are not allowed; otherwise their
/// number is added to *negative. Pivots up to `smallest` count as vanishing.
template <typename Real>
Elimination Eliminate(Front<Real>& front, Real smallest, Workers& workers, int* negative);

}  // namespace carillon::precompute
