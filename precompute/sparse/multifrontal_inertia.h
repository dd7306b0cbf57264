// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "absl/status/statusor.h"
#include "precompute/sparse/front_walk.h"
#include "precompute/sparse/frontal_structure.h"
#include "precompute/sparse/node_matrix.h"

namespace carillon::precompute {

/// Returns the number of eigenvalues of K x = Lambda M x below `shift`. By Sylvester's law of
/// inertia, this is the number of negative pivots in a factorization K - shift M = L S L^T with
/// signs S and without pivoting. Errors: VERIFICATION_FAILED if a pivot is too small for its sign
/// to be trusted, which means that the shift lies on an eigenvalue and must be moved.
absl::StatusOr<int> CountEigenvaluesBelow(const FrontalStructure& fronts, const NodeMatrix& A,
                                          double shift, Workers& workers, const PartDone& progress);

}  // namespace carillon::precompute
